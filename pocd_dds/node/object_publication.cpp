#include "pocd_dds/node/object_publication.hpp"

#include <utility>

#include "pocd_dds/bridge/geometry_messages.hpp"

namespace pocd::dds {

ObjectPublication::ObjectPublication(const std::shared_ptr<Participant>& participant,
                                     const NodeFile& config, std::uint64_t epoch,
                                     std::uint64_t lineage)
    : node_(config.node),
      classes_(config.pipeline.classes),
      run_{static_cast<std::uint32_t>(config.node.map_id), epoch, lineage},
      states_(participant, topics::kObjects),
      events_(participant, topics::kObjectEvents) {
  const RosOutputConfig& outputs = node_.outputs;
  if (outputs.twins_hz <= 0.0) return;
  const auto make = [&](auto& writer, const TopicSpec& spec) {
    writer = std::make_unique<typename std::decay_t<decltype(writer)>::element_type>(
        participant, spec, topics::in_namespace(spec, outputs.topic_namespace));
  };
  make(ros_list_, topics::kRosObjects);
  make(ros_events_, topics::kRosObjectEvents);
}

void ObjectPublication::note_removal(ObjectId id, bool forgotten) {
  if (!ros_list_) return;
  pocd_msgs::msg::ObjectRemoval& removal = removals_.emplace_back();
  removal.uuid(object_uuid(run_.names(), id));
  removal.local_id(static_cast<std::uint32_t>(to_index(id)));
  removal.stamp(to_time(stamp_ns_));
  removal.forgotten(forgotten);
  if (removals_.size() > kMostRemovals) removals_.pop_front();
}

void ObjectPublication::add(const FrameResult& result, StampNs stamp_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  stamp_ns_ = stamp_ns;
  if (!result.changed_objects.empty() || !result.retired.empty()) list_outdated_ = true;
  for (const ObjectEvent& event : result.events) {
    // A gap in their numbers, which subscribers see.
    if (events_waiting_.size() >= kMostEvents) events_waiting_.pop_front(), ++dropped_events_;
    events_waiting_.push_back(event);
  }
  for (const ObjectSnapshot& object : result.changed_objects) {
    ObjectSnapshot& known = objects_[object.id] = object;
    // By this frame: stamps of before may be later, when the clocks were set back.
    if (object.last_seen_ns == stamp_ns) unseen_.erase(object.id);
    known.seen_in_run = unseen_.count(object.id) == 0;
    changed_.insert(object.id);
    touched_.insert(object.id);
  }
  std::set<ObjectId> forgotten;
  for (const ObjectEvent& event : result.events) {
    if (event.kind == EventKind::kOperator) forgotten.insert(event.object);
  }
  for (const ObjectId id : result.retired) {
    unseen_.erase(id);
    const auto known = objects_.find(id);
    if (known != objects_.end()) note_removal(id, forgotten.count(id) > 0);
    if (known != objects_.end() && forgotten.count(id) > 0) {
      forgotten_.push_back(std::move(known->second));
      forgotten_.back().forgotten = true;
      objects_.erase(known);
      changed_.erase(id);
      touched_.insert(id);
      continue;
    }
    objects_.erase(id);
    changed_.erase(id);
    touched_.insert(id);
    gone_.insert(id);
  }
}

void ObjectPublication::send_events() {
  std::deque<ObjectEvent> events;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    events.swap(events_waiting_);
  }
  for (const ObjectEvent& event : events) {
    auto message = event_message(event, run_, classes_, node_.map_frame);
    events_.write(message);
    if (ros_events_) ros_events_->write(message);
  }
}

void ObjectPublication::restore(const std::vector<ObjectSnapshot>& objects, StampNs stamp_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  stamp_ns_ = stamp_ns;
  for (const ObjectSnapshot& object : objects) {
    objects_[object.id] = object;
    objects_[object.id].seen_in_run = false;
    unseen_.insert(object.id);
    changed_.insert(object.id);
    touched_.insert(object.id);
  }
}

void ObjectPublication::dispose_gone() {
  std::set<ObjectId> gone;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    gone.swap(gone_);
  }
  for (const ObjectId id : gone) {
    if (published_.count(id) == 0) continue;  // nobody has heard of it
    pocd_msgs::msg::ObjectState state;
    state.uuid(object_uuid(run_.names(), id));
    if (states_.dispose(state)) {
      published_.erase(id);
      continue;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    gone_.insert(id);
  }
}

void ObjectPublication::send_forgotten() {
  const auto time = std::chrono::steady_clock::now();
  std::vector<ObjectSnapshot> forgotten;
  StampNs stamp_ns = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    forgotten.swap(forgotten_);
    stamp_ns = stamp_ns_;
    while (!said_forgotten_.empty() && time - said_forgotten_.front().second > kForgottenStays) {
      gone_.insert(said_forgotten_.front().first);
      said_forgotten_.pop_front();
    }
  }
  for (ObjectSnapshot& object : forgotten) {
    auto message = object_message(object, run_, classes_, stamp_ns, node_.map_frame);
    if (states_.write(message)) {
      published_.insert(object.id);
      said_forgotten_.emplace_back(object.id, time);
      continue;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    forgotten_.push_back(std::move(object));
  }
}

std::vector<ObjectId> ObjectPublication::take_due(bool now) {
  const auto time = std::chrono::steady_clock::now();
  const double since_s = std::chrono::duration<double>(time - last_sent_).count();
  if (!now && since_s < node_.object_period_s) return {};
  const std::lock_guard<std::mutex> lock(mutex_);
  if (changed_.empty()) return {};
  last_sent_ = time;
  std::vector<ObjectId> due(changed_.begin(), changed_.end());
  changed_.clear();
  return due;
}

bool ObjectPublication::send_state(ObjectId id) {
  ObjectSnapshot object;
  StampNs stamp_ns = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto known = objects_.find(id);
    if (known == objects_.end()) return true;  // has gone meanwhile
    object = known->second;
    stamp_ns = stamp_ns_;
  }
  auto message = object_message(object, run_, classes_, stamp_ns, node_.map_frame);
  if (!states_.write(message)) return false;
  published_.insert(id);
  return true;
}

void ObjectPublication::send_list(bool now) {
  if (!ros_list_) return;
  const auto time = std::chrono::steady_clock::now();
  const double since_s = std::chrono::duration<double>(time - list_sent_).count();
  if (!now && since_s * node_.outputs.twins_hz < 1.0) return;
  std::map<ObjectId, ObjectSnapshot> objects;
  pocd_msgs::msg::ObjectList list;
  StampNs stamp_ns = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!list_outdated_) return;
    list_outdated_ = false;
    objects = objects_;
    list.removed().assign(removals_.begin(), removals_.end());
    stamp_ns = stamp_ns_;
  }
  list_sent_ = time;
  list.header(header_of(stamp_ns, node_.map_frame));
  list.map_id(run_.map_id);
  list.epoch(run_.epoch);
  list.lineage(run_.names());
  list.number(++lists_);
  for (const auto& [id, object] : objects) {
    list.objects().push_back(object_message(object, run_, classes_, stamp_ns, node_.map_frame));
  }
  if (ros_list_->write(list)) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  list_outdated_ = true;
}

void ObjectPublication::send_due(bool now) {
  send_events();
  // What Fast DDS refuses, because the writer is full, is tried again next time.
  send_forgotten();
  dispose_gone();
  for (const ObjectId id : take_due(now)) {
    if (send_state(id)) continue;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (objects_.count(id) > 0) changed_.insert(id);
  }
  // What went while its state was written.
  dispose_gone();
  send_list(now);
}

bool ObjectPublication::wait_acknowledged(std::chrono::steady_clock::time_point end) {
  return states_.wait_acknowledged(end) && events_.wait_acknowledged(end) &&
         (!ros_list_ || (ros_list_->wait_acknowledged(end) && ros_events_->wait_acknowledged(end)));
}

}  // namespace pocd::dds

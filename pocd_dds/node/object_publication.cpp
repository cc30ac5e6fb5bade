#include "pocd_dds/node/object_publication.hpp"

namespace pocd::dds {

ObjectPublication::ObjectPublication(const std::shared_ptr<Participant>& participant,
                                     const NodeFile& config, std::uint64_t epoch,
                                     std::uint64_t lineage)
    : node_(config.node),
      classes_(config.pipeline.classes),
      run_{static_cast<std::uint32_t>(config.node.map_id), epoch, lineage},
      states_(participant, topics::kObjects),
      events_(participant, topics::kObjectEvents) {}

void ObjectPublication::add(const FrameResult& result, StampNs stamp_ns) {
  stamp_ns_ = stamp_ns;
  for (const ObjectEvent& event : result.events) {
    auto message = event_message(event, run_, classes_, node_.map_frame);
    events_.write(message);
  }
  for (const ObjectSnapshot& object : result.changed_objects) {
    ObjectSnapshot& known = objects_[object.id] = object;
    known.seen_in_run = !known_until_ns_ || object.last_seen_ns > *known_until_ns_;
    changed_.insert(object.id);
    touched_.insert(object.id);
  }
  for (const ObjectId id : result.retired) {
    objects_.erase(id);
    changed_.erase(id);
    touched_.insert(id);
    if (published_.erase(id) > 0) gone_.insert(id);
  }
  dispose_gone();
}

void ObjectPublication::restore(const std::vector<ObjectSnapshot>& objects, StampNs stamp_ns) {
  known_until_ns_ = stamp_ns;
  FrameResult known;
  known.changed_objects = objects;
  add(known, stamp_ns);
}

void ObjectPublication::dispose_gone() {
  for (auto id = gone_.begin(); id != gone_.end();) {
    pocd_msgs::msg::ObjectState state;
    state.uuid(object_uuid(run_.names(), *id));
    id = states_.dispose(state) ? gone_.erase(id) : std::next(id);
  }
}

void ObjectPublication::send_due(bool now) {
  if (changed_.empty() && gone_.empty()) return;
  const auto time = std::chrono::steady_clock::now();
  if (!now && std::chrono::duration<double>(time - last_sent_).count() < node_.object_period_s) {
    return;
  }
  last_sent_ = time;
  // What Fast DDS refuses, because the writer is full, is tried again next time.
  dispose_gone();
  for (auto id = changed_.begin(); id != changed_.end();) {
    auto message = object_message(objects_.at(*id), run_, classes_, stamp_ns_, node_.map_frame);
    if (!states_.write(message)) {
      ++id;
      continue;
    }
    published_.insert(*id);
    id = changed_.erase(id);
  }
}

bool ObjectPublication::wait_acknowledged(std::chrono::steady_clock::time_point end) {
  return states_.wait_acknowledged(end) && events_.wait_acknowledged(end);
}

}  // namespace pocd::dds

#include "view/object_feed.hpp"

#include <algorithm>
#include <cmath>

#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/object_messages.hpp"

namespace pocd::view {
namespace {

constexpr StampNs kAbsent_ns = 5000000000;  // a robot that has said nothing for longer
constexpr std::size_t kMostTrail = 120;     // places
constexpr double kTrailStep_m = 0.15;

/// Stands where the other one stood: closer than half of the longer side, as seen from above.
bool same_place(const OrientedBox& a, const OrientedBox& b) {
  const double reach = 0.5 * std::max({a.size_m.x(), a.size_m.y(), b.size_m.x(), b.size_m.y()});
  return (a.pose.position_W - b.pose.position_W).head<2>().norm() < reach;
}

}  // namespace

std::uint32_t ObjectFeed::run_of_locked(std::uint64_t epoch, std::uint64_t lineage) {
  if (epoch == 0) return 0;
  lineages_[epoch] = dds::MapRun{0, epoch, lineage}.names();
  const auto next = static_cast<std::uint32_t>(runs_.size() + 1);
  return runs_.emplace(lineages_[epoch], next).first->second;
}

void ObjectFeed::know_run(std::uint64_t epoch, std::uint64_t lineage) {
  const std::lock_guard<std::mutex> lock(mutex_);
  run_of_locked(epoch, lineage);
}

std::uint32_t ObjectFeed::run_of(std::uint64_t epoch) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto lineage = lineages_.find(epoch);
  return lineage == lineages_.end() ? 0 : runs_.at(lineage->second);
}

void ObjectFeed::heard(StampNs stamp_ns) {
  first_ns_ = std::min(first_ns_.value_or(stamp_ns), stamp_ns);
  last_ns_ = std::max(last_ns_.value_or(stamp_ns), stamp_ns);
}

void ObjectFeed::object(const WatchedObject& object) {
  const std::lock_guard<std::mutex> lock(mutex_);
  heard(object.state.first_seen_ns);
  heard(object.state.last_seen_ns);
  const std::string uuid = hex(object.uuid);
  history_.state(uuid, object, run_of_locked(object.epoch, object.lineage), *last_ns_);
  for (auto other = unknown_.begin(); other != unknown_.end();) {
    if (other->second.epoch == object.epoch ||
        !same_place(other->second.state.box, object.state.box)) {
      ++other;
      continue;
    }
    say_gone(other->second, "seen_again");
    other = unknown_.erase(other);
  }
  board_.put_notice("object/" + uuid,
                    text_of(object_json(object, run_of_locked(object.epoch, object.lineage),
                                        object.state.seen_in_run ? "present" : "unknown")));
}

void ObjectFeed::gone(const WatchedObject& object, Gone why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::string uuid = hex(object.uuid);
  history_.gone(uuid, last_ns_.value_or(0));
  if (why == Gone::kRemoved) {
    say_gone(object, "removed");
    return;
  }
  if (why == Gone::kForgotten) {
    say_gone(object, "forgotten");
    return;
  }
  unknown_[uuid] = object;
  if (unknown_.size() > History::kMostObjects) unknown_.erase(unknown_.begin());
  board_.put_notice(
      "object/" + uuid,
      text_of(object_json(object, run_of_locked(object.epoch, object.lineage), "unknown")));
}

void ObjectFeed::say_gone(const WatchedObject& object, const std::string& why) {
  Json json = object_json(object, run_of_locked(object.epoch, object.lineage), "gone");
  json["why"] = why;
  const std::string key = "object/" + hex(object.uuid);
  board_.put_notice(key, text_of(json));
  departures_.push_back(key);
  if (departures_.size() <= kMostDepartures) return;
  board_.forget_notice(departures_.front());
  departures_.pop_front();
}

bool ObjectFeed::say_event(const pocd_msgs::msg::ObjectEvent& message) {
  const dds::MapRun run{message.map_id(), message.epoch(), message.lineage()};
  const EventName name{run.names(), message.seq()};
  if (!known_events_.insert(name).second) return false;
  heard(dds::to_stamp(message.header().stamp()));
  const std::uint64_t number = ++event_count_;
  const std::string key = "event/" + std::to_string(number);
  board_.put_notice(
      key, text_of(event_json(message, number, run_of_locked(message.epoch(), message.lineage()))));
  events_.emplace_back(key, name);
  if (events_.size() <= kMostEvents) return true;
  board_.forget_notice(events_.front().first);
  known_events_.erase(events_.front().second);
  events_.pop_front();
  return true;
}

void ObjectFeed::event(const pocd_msgs::msg::ObjectEvent& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  say_event(message);
}

void ObjectFeed::logged(const pocd_msgs::msg::ObjectEvent& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!say_event(message) || message.local_id() == 0) return;
  const ObjectEvent event = dds::event_from(message);
  WatchedObject object;
  object.class_name = message.class_name();
  object.state.id = event.object;
  object.state.stationarity_class = event.evidence.stationarity_class;
  const bool gone = event.kind == EventKind::kRemoved || event.kind == EventKind::kOperator;
  const std::uint32_t run = run_of_locked(message.epoch(), message.lineage());
  history_.logged(hex(message.uuid()), object, run,
                  {event.stamp_ns, event.box, event.evidence.after, 0}, gone);
  if (!event.absorbed) return;
  object.state.id = *event.absorbed;
  history_.logged(hex(message.absorbed_uuid()), object, run,
                  {event.stamp_ns, event.box, event.evidence.after, 0}, true);
}

void ObjectFeed::robot(const RobotPose& pose) {
  const std::lock_guard<std::mutex> lock(mutex_);
  heard(pose.stamp_ns);
  auto& past = poses_[pose.name];
  if (past.empty() || past.back().stamp_ns < pose.stamp_ns) past.push_back(pose);
  if (past.size() > kMostPoses) {
    std::deque<RobotPose> kept;
    for (std::size_t i = 0; i < past.size(); ++i) {
      if (i % 2 == 0 || i >= past.size() / 2) kept.push_back(past[i]);
    }
    past = std::move(kept);
  }
  board_.put_notice("robot/" + pose.name, text_of(robot_json(pose)));
}

std::optional<std::pair<double, double>> ObjectFeed::time_range() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!first_ns_) return std::nullopt;
  return std::pair(seconds(*first_ns_), seconds(*last_ns_));
}

std::size_t ObjectFeed::unknown() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return unknown_.size();
}

std::optional<std::string> ObjectFeed::history(const std::string& uuid) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const History::Record* record = history_.find(uuid);
  if (record == nullptr) return std::nullopt;
  return text_of(record_json(uuid, *record));
}

Json ObjectFeed::robots_then(StampNs stamp_ns) const {
  Json robots = Json::array();
  for (const auto& [name, past] : poses_) {
    auto after = std::upper_bound(
        past.begin(), past.end(), stamp_ns,
        [](StampNs stamp, const RobotPose& pose) { return stamp < pose.stamp_ns; });
    if (after == past.begin()) continue;
    const RobotPose& pose = *std::prev(after);
    if (stamp_ns - pose.stamp_ns > kAbsent_ns) continue;
    Json json = robot_json(pose);
    Json& trail = json["trail"] = Json::array();
    Eigen::Vector3d last = pose.position_W;
    while (after != past.begin() && trail.size() < kMostTrail) {
      const RobotPose& one = *--after;
      if ((one.position_W - last).norm() < kTrailStep_m) continue;
      last = one.position_W;
      trail.push_back({std::round(last.x() * 100) / 100, std::round(last.y() * 100) / 100});
    }
    robots.push_back(std::move(json));
  }
  return robots;
}

std::string ObjectFeed::then(StampNs stamp_ns, bool map) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Json objects = Json::array();
  for (const auto& [uuid, sample] : history_.at(stamp_ns)) {
    const History::Record& record = *history_.find(uuid);
    Json json = sample_json(sample);
    json["id"] = uuid;
    json["run"] = record.run;
    json["number"] = record.number;
    json["class"] = record.class_name;
    json["static"] = record.stationarity_class == 1;
    objects.push_back(std::move(json));
  }
  return text_of({{"type", "then"},
                  {"stamp", seconds(stamp_ns)},
                  {"map", map},
                  {"objects", objects},
                  {"robots", robots_then(stamp_ns)}});
}

}  // namespace pocd::view

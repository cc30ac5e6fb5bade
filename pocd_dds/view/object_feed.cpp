#include "view/object_feed.hpp"

#include <algorithm>
#include <cmath>

#include "pocd_dds/bridge/conversions.hpp"

namespace pocd::view {
namespace {

/// Stands where the other one stood: closer than half of the longer side, as seen from above.
bool same_place(const OrientedBox& a, const OrientedBox& b) {
  const double reach = 0.5 * std::max({a.size_m.x(), a.size_m.y(), b.size_m.x(), b.size_m.y()});
  return (a.pose.position_W - b.pose.position_W).head<2>().norm() < reach;
}

}  // namespace

std::uint32_t ObjectFeed::run_of_locked(std::uint64_t epoch) {
  if (epoch == 0) return 0;
  const auto next = static_cast<std::uint32_t>(runs_.size() + 1);
  return runs_.emplace(epoch, next).first->second;
}

std::uint32_t ObjectFeed::run_of(std::uint64_t epoch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return run_of_locked(epoch);
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
  history_.state(uuid, object, *last_ns_);
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
                    text_of(object_json(object, run_of_locked(object.epoch),
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
  board_.put_notice("object/" + uuid,
                    text_of(object_json(object, run_of_locked(object.epoch), "unknown")));
}

void ObjectFeed::say_gone(const WatchedObject& object, const std::string& why) {
  Json json = object_json(object, run_of_locked(object.epoch), "gone");
  json["why"] = why;
  const std::string key = "object/" + hex(object.uuid);
  board_.put_notice(key, text_of(json));
  departures_.push_back(key);
  if (departures_.size() <= kMostDepartures) return;
  board_.forget_notice(departures_.front());
  departures_.pop_front();
}

void ObjectFeed::event(const pocd_msgs::msg::ObjectEvent& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  heard(dds::to_stamp(message.header().stamp()));
  const std::uint64_t number = ++event_count_;
  const std::string key = "event/" + std::to_string(number);
  board_.put_notice(key, text_of(event_json(message, number, run_of_locked(message.epoch()))));
  events_.push_back(key);
  if (events_.size() <= kMostEvents) return;
  board_.forget_notice(events_.front());
  events_.pop_front();
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

std::string ObjectFeed::then(StampNs stamp_ns) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Json objects = Json::array();
  for (const auto& [uuid, sample] : history_.at(stamp_ns)) {
    const History::Record& record = *history_.find(uuid);
    Json json = sample_json(sample);
    json["id"] = uuid;
    json["number"] = record.number;
    json["class"] = record.class_name;
    json["static"] = record.stationarity_class == 1;
    objects.push_back(std::move(json));
  }
  return text_of({{"type", "then"}, {"stamp", seconds(stamp_ns)}, {"objects", objects}});
}

}  // namespace pocd::view

#include "view/history.hpp"

#include <algorithm>
#include <cmath>

namespace pocd::view {
namespace {

constexpr StampNs kDense = 1000000000;  // a sample at least that often while it is seen

bool same(const ObjectSample& a, const ObjectSample& b) {
  return std::abs(a.belief.stationarity() - b.belief.stationarity()) < 0.005 &&
         (a.box.pose.position_W - b.box.pose.position_W).norm() < 0.01 &&
         (a.box.size_m - b.box.size_m).norm() < 0.01 &&
         std::abs(a.box.pose.yaw_rad - b.box.pose.yaw_rad) < 0.01;
}

/// Drops every second of the older half, but for the first.
void thin(std::deque<ObjectSample>& samples) {
  std::deque<ObjectSample> kept;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i == 0 || i % 2 == 0 || i >= samples.size() / 2) kept.push_back(samples[i]);
  }
  samples = std::move(kept);
}

}  // namespace

void History::state(const std::string& uuid, const WatchedObject& object, std::uint32_t run,
                    StampNs now_ns) {
  Record& record = records_[uuid];
  record.run = run;
  record.class_name = object.class_name;
  record.number = to_index(object.state.id);
  record.stationarity_class = object.state.stationarity_class;
  record.first_ns = object.state.first_seen_ns;
  record.gone_ns.reset();
  // A belief that falls because the object is missed has the stamp of what was heard meanwhile.
  ObjectSample sample{std::max(object.state.last_seen_ns, now_ns), object.state.box,
                      object.state.belief, object.state.observations};
  auto& samples = record.samples;
  if (!samples.empty()) {
    sample.stamp_ns = std::max(sample.stamp_ns, samples.back().stamp_ns);
    if (same(samples.back(), sample) && sample.stamp_ns - samples.back().stamp_ns < kDense) return;
  }
  samples.push_back(sample);
  if (samples.size() > kMostSamples) thin(samples);
  forget_departed();
}

void History::forget_departed() {
  while (records_.size() > kMostObjects && !departed_.empty()) {
    const auto oldest = records_.find(departed_.front());
    if (oldest != records_.end() && oldest->second.gone_ns) records_.erase(oldest);
    departed_.pop_front();
  }
}

void History::logged(const std::string& uuid, const WatchedObject& object, std::uint32_t run,
                     const ObjectSample& sample, bool gone) {
  const auto [entry, is_new] = records_.try_emplace(uuid);
  Record& record = entry->second;
  if (is_new) {
    record.class_name = object.class_name;
    record.number = to_index(object.state.id);
    record.run = run;
    record.stationarity_class = object.state.stationarity_class;
    record.first_ns = sample.stamp_ns;
  }
  record.first_ns = std::min(record.first_ns, sample.stamp_ns);
  auto& samples = record.samples;
  const auto after =
      std::upper_bound(samples.begin(), samples.end(), sample.stamp_ns,
                       [](StampNs stamp, const ObjectSample& s) { return stamp < s.stamp_ns; });
  const bool newest = after == samples.end();
  samples.insert(after, sample);
  // Who is seen after it went has come back.
  if (gone && newest && !record.gone_ns) {
    record.gone_ns = sample.stamp_ns;
    departed_.push_back(uuid);
  }
  if (!gone && newest) record.gone_ns.reset();
  if (samples.size() > kMostSamples) thin(samples);
  forget_departed();
}

void History::gone(const std::string& uuid, StampNs now_ns) {
  const auto record = records_.find(uuid);
  if (record == records_.end() || record->second.gone_ns) return;
  record->second.gone_ns = std::max(now_ns, record->second.samples.back().stamp_ns);
  departed_.push_back(uuid);
}

const History::Record* History::find(const std::string& uuid) const {
  const auto record = records_.find(uuid);
  return record == records_.end() ? nullptr : &record->second;
}

std::vector<std::pair<std::string, ObjectSample>> History::at(StampNs stamp_ns) const {
  std::vector<std::pair<std::string, ObjectSample>> found;
  for (const auto& [uuid, record] : records_) {
    if (record.first_ns > stamp_ns || (record.gone_ns && *record.gone_ns <= stamp_ns)) continue;
    const auto after = std::upper_bound(
        record.samples.begin(), record.samples.end(), stamp_ns,
        [](StampNs stamp, const ObjectSample& sample) { return stamp < sample.stamp_ns; });
    found.emplace_back(uuid, after == record.samples.begin() ? *after : *std::prev(after));
  }
  return found;
}

}  // namespace pocd::view

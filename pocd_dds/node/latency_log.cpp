#include "pocd_dds/node/latency_log.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"

namespace pocd::dds {
namespace {

/// Many more frames than wait anywhere: the others were dropped.
constexpr std::size_t kMostOnTheWay = 1000;

double now_ms() { return clock_ms(CLOCK_REALTIME); }  // the clock of the reception

}  // namespace

LatencyLog::LatencyLog(const std::string& file) {
  if (file.empty()) return;
  file_.open(file);
  file_ << "robot,stamp_ns,waited_ms,processing_ms,writing_ms,latency_ms\n";
  if (!file_) throw InputError("cannot write " + file);
}

void LatencyLog::received(const std::string& robot, StampNs stamp_ns, std::int64_t received_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  double& received_ms = on_the_way_[{robot, stamp_ns}].received_ms;
  received_ms = std::max(received_ms, 1e-6 * static_cast<double>(received_ns));
  if (on_the_way_.size() <= kMostOnTheWay) return;
  const auto oldest = std::min_element(
      on_the_way_.begin(), on_the_way_.end(),
      [](const auto& a, const auto& b) { return a.second.received_ms < b.second.received_ms; });
  on_the_way_.erase(oldest);
}

void LatencyLog::started(const std::string& robot, StampNs stamp_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto way = on_the_way_.find({robot, stamp_ns});
  if (way != on_the_way_.end()) way->second.started_ms = now_ms();
}

void LatencyLog::processed(const std::string& robot, StampNs stamp_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto way = on_the_way_.find({robot, stamp_ns});
  if (way == on_the_way_.end()) return;
  way->second.processed_ms = now_ms();
  processed_.push_back(way->first);
}

void LatencyLog::in_step() {
  const std::lock_guard<std::mutex> lock(mutex_);
  in_step_.insert(in_step_.end(), processed_.begin(), processed_.end());
  processed_.clear();
}

void LatencyLog::written() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double now = now_ms();
  for (const Key& key : in_step_) {
    const auto way = on_the_way_.find(key);
    if (way == on_the_way_.end()) continue;
    const Way& w = way->second;
    longest_ms_ = std::max(longest_ms_, now - w.received_ms);
    if (file_.is_open()) {
      file_ << key.first << ',' << key.second << ',' << w.started_ms - w.received_ms << ','
            << w.processed_ms - w.started_ms << ',' << now - w.processed_ms << ','
            << now - w.received_ms << '\n';
    }
    on_the_way_.erase(way);
  }
  in_step_.clear();
}

double LatencyLog::take_longest_ms() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(longest_ms_, 0.0);
}

}  // namespace pocd::dds

#include "pocd_dds/node/look_publication.hpp"

#include <thread>

namespace pocd::dds {

using Clock = std::chrono::steady_clock;

void LookPublication::note(const std::vector<RegionLook>& looks, bool in_run) {
  if (looks.empty()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const RegionLook& look : looks) {
    const SectorKey sector = sector_of(look.region);
    sectors_[sector][look.region] = {look.stamp_ns, in_run};
    changed_.insert(sector);
  }
}

bool LookPublication::send(const SectorKey& key) {
  pocd_msgs::msg::MapLooks message;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    message = looks_message(key, sectors_[key], run_);
  }
  constexpr std::size_t kHead = 100, kRegion = 24;
  budget_.spend(kHead + kRegion * message.regions().size());
  return writer_.write(message);
}

void LookPublication::send_due() {
  const auto time = Clock::now();
  if (due_.empty() && time - began_ >= kPeriod) {
    const std::lock_guard<std::mutex> lock(mutex_);
    due_.swap(changed_);
    began_ = time;
  }
  // One that is refused is tried again next time.
  while (!due_.empty() && budget_.open(Clock::now()) && send(*due_.begin())) {
    due_.erase(due_.begin());
  }
}

bool LookPublication::finish(Clock::time_point end) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    due_.insert(changed_.begin(), changed_.end());
    changed_.clear();
  }
  for (send_due(); !due_.empty() && Clock::now() < end; send_due()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return due_.empty() && writer_.wait_acknowledged(end);
}

}  // namespace pocd::dds

#include "mirror/shared_participant.hpp"

#include <map>
#include <mutex>
#include <tuple>

namespace pocd::dds {

std::shared_ptr<Participant> shared_participant(const BusOptions& options) {
  static std::mutex mutex;
  static std::map<std::tuple<int, std::string, std::string>, std::weak_ptr<Participant>> known;
  const std::lock_guard<std::mutex> lock(mutex);
  std::weak_ptr<Participant>& entry = known[{options.domain, options.profiles_file, options.name}];
  std::shared_ptr<Participant> participant = entry.lock();
  if (!participant) {
    participant = std::make_shared<Participant>(options);
    entry = participant;
  }
  return participant;
}

}  // namespace pocd::dds

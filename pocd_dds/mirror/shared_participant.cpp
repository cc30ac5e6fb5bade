#include "mirror/shared_participant.hpp"

#include <map>
#include <mutex>
#include <tuple>

namespace pocd::dds {

std::shared_ptr<Participant> shared_participant(const BusOptions& options,
                                                const std::shared_ptr<Participant>& instead_of) {
  static std::mutex mutex;
  using Key = std::tuple<int, std::string, std::string, std::string>;
  static std::map<Key, std::weak_ptr<Participant>> known;
  const std::lock_guard<std::mutex> lock(mutex);
  std::weak_ptr<Participant>& entry =
      known[{options.domain, options.profiles_file, options.name, options.security_folder}];
  std::shared_ptr<Participant> participant = entry.lock();
  if (!participant || participant == instead_of) {
    participant = std::make_shared<Participant>(options);
    entry = participant;
  }
  return participant;
}

}  // namespace pocd::dds

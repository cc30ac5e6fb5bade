// Which endpoints of others were built from another definition of their type than this process.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace pocd::dds {

/// Listens to discovery, before endpoints match, and passes everything on. Thread-safe.
class TypeWatch : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  using Guid = std::array<std::uint8_t, 16>;

  /// `next` hears what this one hears; null: nobody. It must outlive it.
  explicit TypeWatch(eprosima::fastdds::dds::DomainParticipantListener* next) : next_(next) {}

  /// An endpoint announces another version of its type than this process has: who it is and what
  /// the versions are, in words. Endpoints that announce none are not judged.
  std::optional<std::string> other_version(const Guid& endpoint) const;

 private:
  template <class Proxy>
  void hear(const Proxy& proxy, bool gone);
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) override;
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;

  using Prefix = std::array<std::uint8_t, 12>;
  eprosima::fastdds::dds::DomainParticipantListener* const next_;
  std::atomic<bool> any_{false};
  mutable std::mutex mutex_;
  std::map<Prefix, std::string> names_;
  std::map<Guid, std::string> others_;
};

}  // namespace pocd::dds

// Who and what is on the bus, as discovery tells.
#pragma once

#include <array>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace pocd::dds {

using ParticipantKey = std::array<std::uint8_t, 12>;  ///< GUID prefix
using EndpointKey = std::array<std::uint8_t, 16>;     ///< GUID

/// A writer or reader of another participant.
struct BusEndpoint {
  EndpointKey key{};
  std::string topic, type;
  bool writer = true, keyed = false, reliable = false, transient_local = false;
  std::vector<std::string> partitions;
};

struct BusEvent {
  /// kParticipantLeft: it said so. kParticipantLost: nothing was heard of it for its lease.
  enum class Kind { kEndpoint, kEndpointGone, kParticipant, kParticipantLeft, kParticipantLost };
  Kind kind = Kind::kEndpoint;
  ParticipantKey participant{};
  BusEndpoint endpoint;          ///< of kEndpoint; of kEndpointGone only the key
  std::string participant_name;  ///< of kParticipant
  double lease_s = 0.0;          ///< of kParticipant and kParticipantLost
};

/// Collects what discovery tells; nothing is made inside of its callbacks. Thread-safe.
class BusWatch : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// What has happened since the last call, in that order.
  std::vector<BusEvent> take();

  /// `wake` is called when something has happened; it must stay callable until it is replaced.
  void set_wake(std::function<void()> wake);

 private:
  void add(BusEvent event);
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) override;
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;

  std::mutex mutex_;
  std::function<void()> wake_;
  std::vector<BusEvent> events_;
};

}  // namespace pocd::dds

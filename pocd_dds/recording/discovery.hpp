// Writers that appear on the bus, as they are announced.
#pragma once

#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <mutex>
#include <vector>

#include "pocd_dds/recording/recorded_topic.hpp"

namespace pocd::dds {

/// Collects what discovery tells; nothing is made inside of its callbacks. Thread-safe.
class Discovery : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// `wake` is called when something has been announced.
  explicit Discovery(std::function<void()> wake) : wake_(std::move(wake)) {}

  /// What has been announced since the last call, in that order.
  std::vector<RecordedTopic> take();

 private:
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant* participant,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;

  std::function<void()> wake_;
  std::mutex mutex_;
  std::vector<RecordedTopic> announced_;
};

}  // namespace pocd::dds

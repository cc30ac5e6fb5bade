// What a reader of the recorder does with its samples.
#pragma once

#include <atomic>
#include <cstdint>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <optional>

#include "pocd_dds/recording/latched_samples.hpp"
#include "pocd_dds/recording/raw_type.hpp"
#include "pocd_dds/recording/record_queue.hpp"
#include "pocd_dds/recording/recorded_topic.hpp"

namespace pocd::dds {

struct ReceivedCounts {
  std::atomic<std::uint64_t> messages{0}, bytes{0}, lost{0};
};

/// One reader and the channels that its samples go to: takes them on the middleware's threads and
/// puts them into the queue. Queue and counts must outlive it.
class Tap : public eprosima::fastdds::dds::DataReaderListener {
 public:
  /// `instances` is the channel of a keyed topic's instances. `keys_known`: the type's key can be
  /// read from a sample. `latched`: late joiners get the last samples, and so do later files.
  Tap(RecordQueue& queue, ReceivedCounts& counts, std::uint16_t channel,
      std::optional<std::uint16_t> instances, bool keys_known, bool latched)
      : queue_(queue),
        counts_(counts),
        channel_(channel),
        instances_(instances),
        keys_known_(keys_known),
        latched_(latched) {}

  void on_data_available(eprosima::fastdds::dds::DataReader* reader) override;
  /// A late joiner gets nothing of a writer that has gone. (Of a keyed topic its instances go.)
  void on_subscription_matched(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::SubscriptionMatchedStatus& status) override;
  void on_sample_lost(eprosima::fastdds::dds::DataReader*,
                      const eprosima::fastdds::dds::SampleLostStatus& status) override;

 private:
  void take(const eprosima::fastdds::dds::SampleInfo& info);
  std::optional<Latch> latch(const LatchKey& source, Latch::Part part) const;
  void push_instance(recording::MessageHeader header, InstanceChange change,
                     const InstanceKey& key);

  RecordQueue& queue_;
  ReceivedCounts& counts_;
  const std::uint16_t channel_;
  const std::optional<std::uint16_t> instances_;
  const bool keys_known_;
  const bool latched_;
  RawSample sample_;
};

}  // namespace pocd::dds

// Topics of the bus as they are on the wire, for viewers that have their schemas.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "pocd_dds/entities/participant.hpp"
#include "pocd_dds/entities/wakeup.hpp"
#include "pocd_dds/recording/recorded_topic.hpp"

namespace pocd::view {

struct RelayedTopic {
  dds::RecordedTopic topic;      ///< as on the bus
  recording::SchemaText schema;  ///< of its messages, which are CDR
};

struct RelayedSample {
  std::uint64_t number = 0;  ///< 1, 2, ... of its topic
  std::shared_ptr<const recording::Bytes> payload;
};

/// A topic is read only while somebody wants it; until the first one does there is no participant
/// either. Of each topic the last few samples are kept: who is slow misses the older ones.
/// Thread-safe.
class Relay {
 public:
  static constexpr std::size_t kMostSamples = 32;  ///< kept of a topic
  static constexpr std::size_t kMostBytes =
      64 * 1000000;  ///< but no more than that, and the last one

  /// `bus` is that of the participant, but for its name.
  explicit Relay(dds::BusOptions bus);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  /// Called, by a thread of the relay, when samples have come.
  void set_listener(std::function<void()> changed);

  /// Those for ROS 2 tools that the component publishes, and tf.
  const std::vector<RelayedTopic>& topics() const { return topics_; }
  /// `index` is that of topics(). Each call of the first is followed by one of the second. Throws
  /// InputError when the bus cannot be used.
  void want(std::size_t index);
  void unwant(std::size_t index);
  /// What a new subscriber begins after: of a latched topic it gets the last sample.
  std::uint64_t begin(std::size_t index) const;
  /// The first sample after `number`; number 0 when there is none.
  RelayedSample after(std::size_t index, std::uint64_t number) const;

 private:
  class AnyReader;
  struct Tap {
    int wanted = 0;
    std::uint64_t newest = 0;
    std::size_t bytes = 0;
    std::deque<RelayedSample> samples;
    std::unique_ptr<AnyReader> reader;
  };
  void run();
  bool drain(Tap& tap);

  dds::BusOptions bus_;
  std::vector<RelayedTopic> topics_;
  mutable std::mutex mutex_;
  std::function<void()> listener_;
  dds::Wakeup wakeup_;
  std::shared_ptr<dds::Participant> participant_;
  std::vector<Tap> taps_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace pocd::view

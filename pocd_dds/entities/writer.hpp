// A DataWriter of one type, with every write checked.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "pocd_dds/entities/guarded_type.hpp"
#include "pocd_dds/entities/participant.hpp"

namespace pocd::dds {

/// What does not depend on the type. Thread-safe.
class RawWriter {
 public:
  /// Throws InputError naming the topic when Fast DDS makes no writer.
  RawWriter(std::shared_ptr<Participant> participant, const TopicSpec& spec, std::string topic,
            eprosima::fastdds::dds::TypeSupport type, const Delivery& delivery);
  ~RawWriter();
  RawWriter(const RawWriter&) = delete;
  RawWriter& operator=(const RawWriter&) = delete;

  const std::string& topic() const { return topic_; }
  /// Readers matched now.
  int matched() const;
  /// Readers matched ever: grows with every new one.
  int ever_matched() const;
  /// Writes that Fast DDS refused, and readers whose quality of service does not fit.
  std::uint64_t failures() const { return failures_; }
  std::uint64_t incompatible() const;
  /// True when every matched reliable reader has everything.
  bool wait_acknowledged(std::chrono::milliseconds time);
  /// At least once, also when that moment is over; for several writers with one end for all.
  bool wait_acknowledged(std::chrono::steady_clock::time_point end);

 protected:
  bool write_raw(void* sample);
  bool dispose_raw(void* sample);

 private:
  struct Impl;
  std::string topic_;
  std::atomic<std::uint64_t> failures_{0};
  std::unique_ptr<Impl> impl_;
};

/// `PubSubType` is the generated type support, e.g. sensor_msgs::msg::ImagePubSubType.
template <class PubSubType>
class Writer : public RawWriter {
 public:
  using Sample = typename PubSubType::type;

  /// For the topic as the table has it.
  Writer(std::shared_ptr<Participant> participant, const TopicSpec& spec)
      : Writer(std::move(participant), spec, spec.name, spec.delivery) {}
  Writer(std::shared_ptr<Participant> participant, const TopicSpec& spec, const std::string& topic,
         const Delivery& delivery)
      : RawWriter(std::move(participant), spec, topic,
                  // A participant has one type support of a name, and readers may use this one.
                  eprosima::fastdds::dds::TypeSupport(new GuardedType<PubSubType>()), delivery) {}

  /// False, counted and logged once when Fast DDS refuses.
  bool write(Sample& sample) { return write_raw(&sample); }
  /// Says that the instance with this sample's key is gone, and forgets it when all readers know.
  bool dispose(Sample& sample) { return dispose_raw(&sample); }
};

/// Of samples that have another name on the bus than the generated type support gives them, and no
/// key.
template <class PubSubType>
class RenamedWriter : public RawWriter {
 public:
  using Sample = typename PubSubType::type;

  RenamedWriter(std::shared_ptr<Participant> participant, const TopicSpec& spec,
                const std::string& topic)
      : RawWriter(std::move(participant), spec, topic,
                  eprosima::fastdds::dds::TypeSupport(new RenamedType<PubSubType>(spec.type)),
                  spec.delivery) {}

  bool write(Sample& sample) { return write_raw(&sample); }
};

}  // namespace pocd::dds

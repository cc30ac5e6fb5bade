// A DataReader of one type, taken from by polling after a wake-up.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "pocd_dds/entities/guarded_type.hpp"
#include "pocd_dds/entities/participant.hpp"
#include "pocd_dds/entities/wakeup.hpp"

namespace pocd::dds {

/// What came with a sample.
struct SampleMeta {
  using Guid = std::array<std::uint8_t, 16>;
  bool valid =
      true;  ///< false: the instance was disposed or lost its writers; no fields but the key
  bool disposed = false;  ///< its instance, with no data; never true of a valid sample
  /// Key of a keyed sample, as the instance handle has it; our keys are 16 bytes and fit as they
  /// are.
  std::array<std::uint8_t, 16> key{};
  Guid writer{};                 ///< of the one who wrote
  std::int64_t received_ns = 0;  ///< when the reader had all of it, wall clock
};

/// What does not depend on the type. take() from one thread at a time; the rest is thread-safe.
class RawReader {
 public:
  /// `wakeup` is woken by new data and by changes of the match; it must outlive the reader. Throws
  /// InputError naming the topic when Fast DDS makes no reader.
  RawReader(std::shared_ptr<Participant> participant, const TopicSpec& spec, std::string topic,
            eprosima::fastdds::dds::TypeSupport type, const Delivery& delivery, Wakeup& wakeup);
  ~RawReader();
  RawReader(const RawReader&) = delete;
  RawReader& operator=(const RawReader&) = delete;

  const std::string& topic() const { return topic_; }
  /// Writers matched now, and ever.
  int matched() const;
  int ever_matched() const;
  /// The writer with this GUID is matched now.
  bool has_writer(const SampleMeta::Guid& writer) const;
  /// Writers whose quality of service does not fit, each time they are found.
  std::uint64_t incompatible() const;
  /// Those since the last call.
  std::uint64_t take_incompatible();
  /// What the last one of them does not offer, e.g. "reliability"; "" without any.
  std::string refused_policy() const;
  /// Samples that the bus says were lost on the way. One that a reliable reader had no room for
  /// comes again.
  std::uint64_t lost() const;
  /// Samples that have arrived and were not taken yet.
  std::size_t unread() const;
  /// Samples that could not be read since the last call; take() leaves them out. From the thread
  /// that takes.
  std::uint64_t take_damaged();
  /// The same for samples of writers whose version of the type is another one, and the last such
  /// writer, in words; "" without any.
  std::uint64_t take_misread();
  const std::string& misread_from() const;

 protected:
  bool take_raw(void* sample, SampleMeta& meta);
  void wake_again();

 private:
  struct Impl;
  std::string topic_;
  std::unique_ptr<Impl> impl_;
};

/// `PubSubType` is the generated type support, e.g. sensor_msgs::msg::ImagePubSubType.
template <class PubSubType>
class Reader : public RawReader {
 public:
  using Sample = typename PubSubType::type;

  Reader(std::shared_ptr<Participant> participant, const TopicSpec& spec, Wakeup& wakeup)
      : Reader(std::move(participant), spec, spec.name, spec.delivery, wakeup) {}
  Reader(std::shared_ptr<Participant> participant, const TopicSpec& spec, const std::string& topic,
         const Delivery& delivery, Wakeup& wakeup)
      : RawReader(std::move(participant), spec, topic,
                  eprosima::fastdds::dds::TypeSupport(new GuardedType<PubSubType>()), delivery,
                  wakeup) {}

  /// The oldest sample not taken yet; false when there is none.
  bool take(Sample& sample, SampleMeta& meta) { return take_raw(&sample, meta); }

  /// Calls `use` with the samples that wait, at most `most` of them; when there may be more, the
  /// wake-up comes at once. So a peer that sends faster than its samples are used does not hold
  /// everybody else up.
  template <class Use>
  void take_some(int most, Use use) {
    Sample sample;
    SampleMeta meta;
    for (int i = 0; i < most; ++i) {
      if (!take(sample, meta)) return;
      use(sample, meta);
    }
    wake_again();
  }
};

}  // namespace pocd::dds

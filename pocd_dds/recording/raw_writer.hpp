// A writer of recorded payloads.
#pragma once

#include <chrono>
#include <memory>

#include "pocd_dds/entities/participant.hpp"
#include "pocd_dds/recording/recorded_topic.hpp"

namespace pocd::dds {

/// Thread-safe is matched() only.
class PayloadWriter {
 public:
  /// `keep_all`: nothing leaves the history before every reader has it. Throws InputError.
  PayloadWriter(std::shared_ptr<Participant> participant, const RecordedTopic& topic,
                bool keep_all);
  ~PayloadWriter();
  PayloadWriter(const PayloadWriter&) = delete;
  PayloadWriter& operator=(const PayloadWriter&) = delete;

  const RecordedTopic& topic() const { return topic_; }
  int matched() const;
  /// False when Fast DDS refuses.
  bool write(const std::uint8_t* data, std::size_t size);
  /// An instance is disposed or unregistered, or names that of the next sample.
  bool change(InstanceChange change, const InstanceKey& key);
  /// True when every matched reliable reader has everything.
  bool wait_acknowledged(std::chrono::milliseconds time);

 private:
  struct Impl;
  RecordedTopic topic_;
  RawSample sample_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::dds

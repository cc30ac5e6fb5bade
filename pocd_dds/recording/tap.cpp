#include "pocd_dds/recording/tap.hpp"

#include <algorithm>
#include <chrono>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <utility>

namespace pocd::dds {

using namespace eprosima::fastdds::dds;  // NOLINT: this file is about nothing else
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

std::uint64_t nanoseconds(const eprosima::fastrtps::rtps::Time_t& time) {
  const std::int64_t ns = time.to_ns();
  return ns > 0 ? static_cast<std::uint64_t>(ns) : 0;
}

std::uint64_t now_ns() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

}  // namespace

void Tap::on_data_available(DataReader* reader) {
  SampleInfo info;
  while (true) {
    if (sample_.payload.capacity() == 0) sample_.payload = queue_.buffer();
    if (reader->take_next_sample(&sample_, &info) != ReturnCode_t::RETCODE_OK) return;
    take(info);
  }
}

void Tap::on_subscription_matched(DataReader*, const SubscriptionMatchedStatus& status) {
  if (!latched_ || instances_ || status.current_count_change >= 0) return;
  recording::MessageHeader header;
  header.channel = channel_;
  LatchKey writer{};
  const eprosima::fastrtps::rtps::octet* handle = status.last_publication_handle.value;
  std::copy_n(handle, writer.size(), writer.begin());
  queue_.push({header, {}, latch(writer, Latch::Part::kWriterGone)});
}

void Tap::on_sample_lost(DataReader*, const SampleLostStatus& status) {
  counts_.lost += static_cast<std::uint64_t>(status.total_count_change);
}

void Tap::take(const SampleInfo& info) {
  recording::MessageHeader header;
  header.channel = channel_;
  header.sequence = info.sample_identity.sequence_number().low;
  header.log_time_ns = nanoseconds(info.reception_timestamp);
  if (header.log_time_ns == 0) header.log_time_ns = now_ns();
  header.publish_time_ns = nanoseconds(info.source_timestamp);
  InstanceKey key{};
  const eprosima::fastrtps::rtps::octet* handle = info.instance_handle.value;
  std::copy_n(handle, key.size(), key.begin());
  if (!info.valid_data) {
    if (instances_) {
      const bool disposed = info.instance_state == NOT_ALIVE_DISPOSED_INSTANCE_STATE;
      push_instance(header, disposed ? InstanceChange::kDisposed : InstanceChange::kUnregistered,
                    key);
    }
    return;
  }
  if (instances_ && !keys_known_) push_instance(header, InstanceChange::kWritten, key);
  ++counts_.messages;
  counts_.bytes += sample_.payload.size();
  LatchKey source = key;
  if (!instances_) {
    const eprosima::fastrtps::rtps::octet* writer = info.publication_handle.value;
    std::copy_n(writer, source.size(), source.begin());
  }
  queue_.push({header, std::move(sample_.payload), latch(source, Latch::Part::kSample)});
  sample_.payload = {};
}

std::optional<Latch> Tap::latch(const LatchKey& source, Latch::Part part) const {
  if (!latched_) return std::nullopt;
  return Latch{channel_, source, instances_.has_value(), part};
}

void Tap::push_instance(recording::MessageHeader header, InstanceChange change,
                        const InstanceKey& key) {
  header.channel = *instances_;
  const bool written = change == InstanceChange::kWritten;
  queue_.push({header, instance_payload(change, key),
               latch(key, written ? Latch::Part::kInstance : Latch::Part::kGone)});
}

}  // namespace pocd::dds

#include "pocd_dds/entities/reader.hpp"

#include <algorithm>
#include <atomic>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <mutex>
#include <set>
#include <utility>

#include "pocd/common/check.hpp"
#include "pocd_dds/entities/bus_log.hpp"
#include "pocd_dds/entities/idl_version.hpp"
#include "pocd_dds/entities/policy_name.hpp"

namespace pocd::dds {

using namespace eprosima::fastdds::dds;  // NOLINT: this file is about nothing else
using eprosima::fastrtps::types::ReturnCode_t;

struct RawReader::Impl : DataReaderListener {
  std::shared_ptr<Participant> participant;
  std::shared_ptr<Topic> use;
  DataReader* reader = nullptr;
  Participant::Guid guid{};
  Wakeup* wakeup = nullptr;
  std::string topic;
  std::atomic<int> matched{0}, ever_matched{0};
  std::atomic<std::uint64_t> incompatible{0}, told{0}, lost{0};
  std::uint64_t damaged = 0, misread = 0;  // by the thread that takes
  std::string misread_from;
  bool reliable = false;
  mutable std::mutex mutex;
  std::set<SampleMeta::Guid> writers;
  std::string refused_policy;

  void on_data_available(DataReader*) override { wakeup->wake(); }
  void on_subscription_matched(DataReader*, const SubscriptionMatchedStatus& status) override {
    matched = status.current_count;
    ever_matched = status.total_count;
    {
      const SampleMeta::Guid guid = to_guid(status.last_publication_handle);
      const std::lock_guard<std::mutex> lock(mutex);
      if (status.current_count_change > 0) {
        writers.insert(guid);
      } else {
        writers.erase(guid);
      }
    }
    wakeup->wake();
  }
  void on_sample_lost(DataReader*, const SampleLostStatus& status) override {
    lost += static_cast<std::uint64_t>(status.total_count_change);
  }
  // A reliable writer sends again what found no room; not what is of one instance too many.
  void on_sample_rejected(DataReader*, const SampleRejectedStatus& status) override {
    const bool again = reliable && status.last_reason != REJECTED_BY_INSTANCES_LIMIT;
    if (!again) lost += static_cast<std::uint64_t>(status.total_count_change);
  }
  void on_requested_incompatible_qos(DataReader*,
                                     const RequestedIncompatibleQosStatus& status) override {
    const std::string policy = policy_name(static_cast<std::int32_t>(status.last_policy_id));
    {
      const std::lock_guard<std::mutex> lock(mutex);
      refused_policy = policy;
    }
    if (incompatible.fetch_add(1) == 0) {
      log_warning("{}: a writer does not offer the {} that is asked for: it is not heard", topic,
                  policy);
    }
  }
};

RawReader::RawReader(std::shared_ptr<Participant> participant, const TopicSpec& spec,
                     std::string topic, TypeSupport type, const Delivery& delivery, Wakeup& wakeup)
    : topic_(std::move(topic)), impl_(std::make_unique<Impl>()) {
  POCD_CHECK(type.get_type_name() == spec.type && type->m_isGetKeyDefined == spec.keyed);
  impl_->participant = std::move(participant);
  impl_->wakeup = &wakeup;
  impl_->topic = topic_;
  Participant& owner = *impl_->participant;
  impl_->use = owner.topic(topic_, type);
  DataReaderQos qos = owner.reader_qos(topic_, delivery);
  qos.user_data().data_vec(idl_announcement(spec.type));
  impl_->reliable = qos.reliability().kind == RELIABLE_RELIABILITY_QOS;
  impl_->reader = owner.make_reader(*owner.subscriber(), *impl_->use, qos, *impl_);
  if (impl_->reader == nullptr) throw InputError("cannot create a reader of topic " + topic_);
  impl_->guid = to_guid(impl_->reader->get_instance_handle());
  owner.joined(impl_->guid, {topic_, true});
}

RawReader::~RawReader() {
  impl_->participant->left(impl_->guid);
  impl_->participant->delete_reader(*impl_->participant->subscriber(), *impl_->reader);
}

int RawReader::matched() const { return impl_->matched; }
int RawReader::ever_matched() const { return impl_->ever_matched; }
bool RawReader::has_writer(const SampleMeta::Guid& writer) const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  return impl_->writers.count(writer) > 0;
}
std::uint64_t RawReader::incompatible() const { return impl_->incompatible; }
std::uint64_t RawReader::take_incompatible() {
  const std::uint64_t count = impl_->incompatible;
  return count - impl_->told.exchange(count);
}
std::string RawReader::refused_policy() const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  return impl_->refused_policy;
}
std::uint64_t RawReader::lost() const { return impl_->lost; }
std::size_t RawReader::unread() const { return impl_->reader->get_unread_count(); }

std::uint64_t RawReader::take_damaged() { return std::exchange(impl_->damaged, 0); }
std::uint64_t RawReader::take_misread() { return std::exchange(impl_->misread, 0); }
const std::string& RawReader::misread_from() const { return impl_->misread_from; }
void RawReader::wake_again() { impl_->wakeup->wake(); }

bool RawReader::take_raw(void* sample, SampleMeta& meta) {
  SampleInfo info;
  // A damaged sample ends the call without a sample, though good ones may be behind it.
  constexpr int kMostBad = 100;
  for (int bad = 0; bad < kMostBad; ++bad) {
    const std::uint64_t damaged_before = damaged_payloads();
    const auto taken = impl_->reader->take_next_sample(sample, &info);
    const std::uint64_t damaged = damaged_payloads() - damaged_before;
    impl_->damaged += damaged;
    const bool got = taken == ReturnCode_t::RETCODE_OK;
    if (!got && damaged == 0) return false;
    if (!got) continue;
    meta.writer = to_guid(info.publication_handle);
    // Its bytes may be read as this type, and mean something else.
    const std::optional<std::string> other = impl_->participant->other_version(meta.writer);
    if (other) {
      ++impl_->misread;
      impl_->misread_from = *other;
      continue;
    }
    meta.valid = info.valid_data;
    // The state is that of the instance now: of a sample that was followed by a dispose, too.
    meta.disposed = !info.valid_data && info.instance_state == NOT_ALIVE_DISPOSED_INSTANCE_STATE;
    const eprosima::fastrtps::rtps::octet* key = info.instance_handle.value;
    std::copy(key, key + meta.key.size(), meta.key.begin());
    meta.received_ns = info.reception_timestamp.to_ns();
    return true;
  }
  wake_again();
  return false;
}

}  // namespace pocd::dds

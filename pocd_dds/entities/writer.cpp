#include "pocd_dds/entities/writer.hpp"

#include <algorithm>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include "pocd/common/check.hpp"
#include "pocd_dds/entities/bus_log.hpp"
#include "pocd_dds/entities/idl_version.hpp"
#include "pocd_dds/entities/policy_name.hpp"

namespace pocd::dds {

using namespace eprosima::fastdds::dds;  // NOLINT: this file is about nothing else
using eprosima::fastrtps::types::ReturnCode_t;

struct RawWriter::Impl : DataWriterListener {
  std::shared_ptr<Participant> participant;
  std::shared_ptr<Topic> use;
  DataWriter* writer = nullptr;
  Participant::Guid guid{};
  std::string topic;
  std::atomic<int> matched{0}, ever_matched{0};
  std::atomic<std::uint64_t> incompatible{0}, misreaders{0};

  void on_publication_matched(DataWriter*, const PublicationMatchedStatus& status) override {
    matched = status.current_count;
    ever_matched = status.total_count;
    if (status.current_count_change <= 0) return;
    const Participant::Guid reader = to_guid(status.last_subscription_handle);
    const std::optional<std::string> other = participant->other_version(reader);
    if (other && misreaders.fetch_add(1) == 0) {
      log_warning("{}: a reader cannot make use of it: {}", topic, *other);
    }
  }
  void on_offered_incompatible_qos(DataWriter*,
                                   const OfferedIncompatibleQosStatus& status) override {
    if (incompatible.fetch_add(1) == 0) {
      log_warning("{}: a reader asks for {} that is not offered: it gets nothing", topic,
                  policy_name(static_cast<std::int32_t>(status.last_policy_id)));
    }
  }
};

RawWriter::RawWriter(std::shared_ptr<Participant> participant, const TopicSpec& spec,
                     std::string topic, TypeSupport type, const Delivery& delivery)
    : topic_(std::move(topic)), impl_(std::make_unique<Impl>()) {
  POCD_CHECK(type.get_type_name() == spec.type && type->m_isGetKeyDefined == spec.keyed);
  impl_->participant = std::move(participant);
  impl_->topic = topic_;
  Participant& owner = *impl_->participant;
  impl_->use = owner.topic(topic_, type);
  DataWriterQos qos = owner.writer_qos(topic_, delivery);
  qos.user_data().data_vec(idl_announcement(spec.type));
  impl_->writer = owner.publisher()->create_datawriter(impl_->use.get(), qos, impl_.get());
  if (impl_->writer == nullptr) throw InputError("cannot create a writer of topic " + topic_);
  impl_->guid = to_guid(impl_->writer->get_instance_handle());
  owner.joined(impl_->guid, {topic_, false});
}

RawWriter::~RawWriter() {
  impl_->participant->left(impl_->guid);
  impl_->writer->set_listener(nullptr);
  impl_->participant->publisher()->delete_datawriter(impl_->writer);
}

int RawWriter::matched() const { return impl_->matched; }
int RawWriter::ever_matched() const { return impl_->ever_matched; }
std::uint64_t RawWriter::incompatible() const { return impl_->incompatible; }

bool RawWriter::wait_acknowledged(std::chrono::milliseconds time) {
  const eprosima::fastrtps::Duration_t limit(static_cast<long double>(time.count()) * 1e-3L);
  return impl_->writer->wait_for_acknowledgments(limit) == ReturnCode_t::RETCODE_OK;
}

bool RawWriter::wait_acknowledged(std::chrono::steady_clock::time_point end) {
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
  return wait_acknowledged(std::max(left, std::chrono::milliseconds(0)));
}

bool RawWriter::write_raw(void* sample) {
  if (impl_->writer->write(sample)) return true;
  if (failures_.fetch_add(1) == 0) log_error("{}: Fast DDS refused to write a sample", topic_);
  return false;
}

bool RawWriter::dispose_raw(void* sample) {
  // Unregistering disposes, too. An instance that is only disposed stays in the history for ever
  // and counts against max_instances.
  if (impl_->writer->unregister_instance(sample, HANDLE_NIL) == ReturnCode_t::RETCODE_OK)
    return true;
  if (failures_.fetch_add(1) == 0) log_error("{}: Fast DDS refused to dispose", topic_);
  return false;
}

}  // namespace pocd::dds

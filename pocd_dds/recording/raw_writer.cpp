#include "pocd_dds/recording/raw_writer.hpp"

#include <atomic>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include "pocd/common/check.hpp"

namespace pocd::dds {

using namespace eprosima::fastdds::dds;  // NOLINT: this file is about nothing else
using eprosima::fastrtps::types::ReturnCode_t;

struct PayloadWriter::Impl : DataWriterListener {
  std::shared_ptr<Participant> participant;
  std::shared_ptr<Topic> use;
  Publisher* publisher = nullptr;
  DataWriter* writer = nullptr;
  std::atomic<int> matched{0};

  ~Impl() override {
    if (writer != nullptr) {
      writer->set_listener(nullptr);
      publisher->delete_datawriter(writer);
    }
    if (publisher != nullptr) participant->get()->delete_publisher(publisher);
  }

  void on_publication_matched(DataWriter*, const PublicationMatchedStatus& status) override {
    matched = status.current_count;
  }
};

PayloadWriter::PayloadWriter(std::shared_ptr<Participant> participant, const RecordedTopic& topic,
                             bool keep_all)
    : topic_(topic), impl_(std::make_unique<Impl>()) {
  impl_->participant = std::move(participant);
  Participant& owner = *impl_->participant;
  PublisherQos publisher_qos = PUBLISHER_QOS_DEFAULT;
  for (const std::string& partition : topic.partitions) {
    publisher_qos.partition().push_back(partition.c_str());
  }
  impl_->use = owner.topic(topic.name,
                           TypeSupport(new RawType(topic.type, topic.keyed, key_of(topic.type))));
  impl_->publisher = owner.get()->create_publisher(publisher_qos);
  if (impl_->publisher == nullptr) throw InputError("cannot create a publisher of " + topic.name);
  Delivery delivery;
  delivery.reliable = topic.reliable || keep_all;
  delivery.transient_local = topic.transient_local;
  // How much the original kept is not announced on the bus. A latched topic without keys
  // (tf_static) may have several senders' worth.
  constexpr int kLatched = 1000, kRecent = 10;
  if (topic.transient_local) {
    delivery.keep_last = topic.keyed ? 1 : kLatched;
  } else {
    delivery.keep_last = keep_all ? 0 : kRecent;
    delivery.max_samples = keep_all ? 64 : 0;
  }
  DataWriterQos qos = owner.writer_qos(topic.name, delivery);
  if (topic.exclusive) qos.ownership().kind = EXCLUSIVE_OWNERSHIP_QOS;
  // Both are recorded, and come back, as what they were.
  qos.writer_data_lifecycle().autodispose_unregistered_instances = false;
  impl_->writer = impl_->publisher->create_datawriter(impl_->use.get(), qos, impl_.get());
  if (impl_->writer == nullptr) throw InputError("cannot create a writer of " + topic.name);
}

PayloadWriter::~PayloadWriter() = default;

int PayloadWriter::matched() const { return impl_->matched; }

bool PayloadWriter::write(const std::uint8_t* data, std::size_t size) {
  sample_.payload.assign(data, data + size);
  const bool good = impl_->writer->write(&sample_);
  sample_.key.reset();
  return good;
}

bool PayloadWriter::change(InstanceChange change, const InstanceKey& key) {
  sample_.key = key;
  if (change == InstanceChange::kWritten) return true;
  InstanceHandle_t handle;
  for (std::size_t i = 0; i < key.size(); ++i) handle.value[i] = key[i];
  sample_.payload.assign({0, 1, 0, 0});
  const ReturnCode_t result = change == InstanceChange::kDisposed
                                  ? impl_->writer->dispose(&sample_, handle)
                                  : impl_->writer->unregister_instance(&sample_, handle);
  sample_.key.reset();
  return result == ReturnCode_t::RETCODE_OK;
}

bool PayloadWriter::wait_acknowledged(std::chrono::milliseconds time) {
  const auto seconds = static_cast<std::int32_t>(time.count() / 1000);
  const auto rest = static_cast<std::uint32_t>(time.count() % 1000) * 1'000'000u;
  return impl_->writer->wait_for_acknowledgments({seconds, rest}) == ReturnCode_t::RETCODE_OK;
}

}  // namespace pocd::dds

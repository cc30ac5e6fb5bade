#include "pocd_dds/entities/participant.hpp"

#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/rtps/flowcontrol/FlowControllerDescriptor.hpp>
#include <map>
#include <mutex>
#include <typeindex>

#include "pocd/common/check.hpp"
#include "pocd_dds/entities/bus_log.hpp"
#include "pocd_dds/entities/discovery_watch.hpp"
#include "pocd_dds/entities/participant_qos.hpp"
#include "pocd_dds/entities/type_watch.hpp"
#include "pocd_dds/entities/watched_transport.hpp"

namespace pocd::dds {

using namespace eprosima::fastdds::dds;  // NOLINT: this file is about nothing else
namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

constexpr int kLastDomain = 232;  // RTPS 2.2, 9.6.1.1: beyond it the port numbers overflow

// The name has to outlive every participant.
constexpr const char* kBackground = "pocd_background";

template <class Qos>
void apply(const Delivery& delivery, Qos& qos) {
  qos.reliability().kind =
      delivery.reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      delivery.transient_local ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  qos.history().kind = delivery.keep_last > 0 ? KEEP_LAST_HISTORY_QOS : KEEP_ALL_HISTORY_QOS;
  qos.history().depth = delivery.keep_last > 0 ? delivery.keep_last : 1;
  // The defaults, 10 instances and 5000 samples, make write() fail beyond them. 0 means no bound.
  qos.resource_limits().max_instances = delivery.max_instances;
  qos.resource_limits().max_samples = delivery.max_samples;
  qos.resource_limits().max_samples_per_instance = delivery.keep_last > 0 ? delivery.keep_last
                                                   : delivery.max_samples_per_instance > 0
                                                       ? delivery.max_samples_per_instance
                                                       : delivery.max_samples;
  qos.resource_limits().allocated_samples = 0;
  if (delivery.deadline_s > 0.0) {
    qos.deadline().period = eprosima::fastrtps::Duration_t(delivery.deadline_s);
  }
  qos.endpoint().history_memory_policy =
      eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
}

/// A limit that a profile says nothing of is Fast DDS's: 10 instances, beyond which write() fails.
/// Then the table's holds.
template <class Qos>
void lift_limits(const Delivery& delivery, Qos& qos) {
  const ResourceLimitsQosPolicy unsaid;
  ResourceLimitsQosPolicy& limits = qos.resource_limits();
  if (limits.max_instances == unsaid.max_instances) limits.max_instances = delivery.max_instances;
  if (limits.max_samples == unsaid.max_samples) limits.max_samples = delivery.max_samples;
  if (limits.max_samples_per_instance == unsaid.max_samples_per_instance) {
    limits.max_samples_per_instance = 0;
  }
}

}  // namespace

int default_domain() {
  const char* text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == '\0') return 0;
  char* end = nullptr;
  const long domain = std::strtol(text, &end, 10);
  if (*end != '\0' || domain < 0 || domain > kLastDomain) {
    throw InputError(std::string("ROS_DOMAIN_ID is \"") + text + "\", expected 0 to 232");
  }
  return static_cast<int>(domain);
}

struct Participant::Impl {
  explicit Impl(const BusOptions& options)
      : watch(options.listener), discovery(options.name, options.stall_s) {}

  TypeWatch watch;
  DiscoveryWatch discovery;
  DomainParticipant* participant = nullptr;
  Publisher* publisher = nullptr;
  Subscriber* subscriber = nullptr;
  std::mutex mutex;
  // The outermost lock: taken with no other of ours held, and by no listener.
  std::mutex making_readers;
  struct UsedTopic {
    Topic* topic = nullptr;
    int users = 0;
  };
  std::map<std::string, UsedTopic> topics;
  std::map<std::string, std::type_index> forms;  // of the types that are registered
  std::map<Guid, Endpoint> endpoints;

  /// The middleware knows types by name: the form that comes second would be dropped, and its
  /// readers and writers given the first.
  void register_type(const std::string& topic, TypeSupport& type) {
    const TopicDataType& support = *type.get();
    const auto [known, fresh] = forms.emplace(type.get_type_name(), typeid(support));
    if (!fresh && known->second != typeid(support)) {
      throw InputError("topic " + topic + ": this participant uses type " + type.get_type_name() +
                       " in another form (" + known->second.name() + " and " +
                       typeid(support).name() + "); give one of the two a participant of its own");
    }
    if (fresh) POCD_CHECK(type.register_type(participant) == ReturnCode_t::RETCODE_OK);
  }
  std::shared_ptr<Topic> use(const std::string& name) {
    UsedTopic& used = topics.at(name);
    ++used.users;
    return {used.topic, [this, name](Topic*) { end_use(name); }};
  }
  void end_use(const std::string& name) {
    const std::lock_guard<std::mutex> lock(mutex);
    UsedTopic& used = topics.at(name);
    if (--used.users > 0) return;
    // Refused when somebody has left a reader or writer behind; the topic is used again then.
    if (participant->delete_topic(used.topic) == ReturnCode_t::RETCODE_OK) topics.erase(name);
  }

  ~Impl() {
    if (participant == nullptr) return;
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
  }
};

Participant::Participant(const BusOptions& options) : impl_(std::make_unique<Impl>(options)) {
  if (options.domain < 0 || options.domain > kLastDomain) {
    throw InputError("domain " + std::to_string(options.domain) + " is not in [0, 232]");
  }
  DomainParticipantQos qos = participant_qos(options);
  const bool secured = !options.security_folder.empty();
  const std::string unwatched = watch_transports(
      qos, {impl_->discovery.calls(), secured ? std::make_shared<std::mutex>() : nullptr});
  if (!unwatched.empty()) {
    log_warning(
        "{}: the profile of the participant uses {}: when Fast DDS's discovery hangs (Fast-DDS "
        "#6502), it is not noticed by what comes that way (docs/operating.md){}",
        options.name, unwatched,
        secured ? ", and a participant that is discovered by it at the same time as another one "
                  "may stay unheard (docs/security.md)"
                : "");
  }
  auto flow = std::make_shared<rtps::FlowControllerDescriptor>();
  flow->name = kBackground;
  flow->max_bytes_per_period = 0;  // no limit: one that limits can block the process
  qos.flow_controllers().push_back(flow);

  impl_->participant = DomainParticipantFactory::get_instance()->create_participant(
      options.domain, qos, &impl_->watch, StatusMask::none());
  if (impl_->participant == nullptr) {
    throw InputError("cannot join domain " + std::to_string(options.domain) +
                     ": Fast DDS made no participant (see its messages; is a network up?" +
                     (secured ? " Are the files in " + options.security_folder +
                                    " of one authority and not expired?)"
                              : ")"));
  }
  impl_->publisher = impl_->participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  impl_->subscriber = impl_->participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  POCD_CHECK(impl_->publisher != nullptr && impl_->subscriber != nullptr);
}

Participant::~Participant() = default;

std::shared_ptr<Topic> Participant::topic(const std::string& name, TypeSupport type) {
  // Cyclone DDS 0.10 refuses endpoints that announce type information in Fast DDS's form.
  type->auto_fill_type_information(false);
  type->auto_fill_type_object(false);
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  impl_->register_type(name, type);
  const auto known = impl_->topics.find(name);
  if (known != impl_->topics.end()) {
    if (known->second.topic->get_type_name() != type.get_type_name()) {
      throw InputError("topic " + name + " is used with two types, " +
                       known->second.topic->get_type_name() + " and " + type.get_type_name());
    }
    return impl_->use(name);
  }
  Topic* topic = impl_->participant->create_topic(name, type.get_type_name(), TOPIC_QOS_DEFAULT);
  if (topic == nullptr) throw InputError("cannot create topic " + name);
  impl_->topics[name] = {topic, 0};
  return impl_->use(name);
}

std::optional<std::string> Participant::other_version(const Guid& endpoint) const {
  return impl_->watch.other_version(endpoint);
}

void Participant::joined(const Guid& endpoint, const Endpoint& what) {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  impl_->endpoints[endpoint] = what;
}

void Participant::left(const Guid& endpoint) {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  impl_->endpoints.erase(endpoint);
}

std::map<Participant::Guid, Participant::Endpoint> Participant::endpoints() const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  return impl_->endpoints;
}

DataWriterQos Participant::writer_qos(const std::string& topic, const Delivery& delivery) const {
  DataWriterQos qos = impl_->publisher->get_default_datawriter_qos();
  if (impl_->publisher->get_datawriter_qos_from_profile(topic, qos) == ReturnCode_t::RETCODE_OK) {
    lift_limits(delivery, qos);
    return qos;
  }
  apply(delivery, qos);
  // As large as a sample is; preallocated, each of the ten of diagnostics would have 5 MB. (Readers
  // of Fast DDS 2.9.1 refuse disposes without a payload then.)
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  // The default of 3 s is how long a lost last sample would stay lost. A writer that keeps all is
  // one whose sender waits for acknowledgements, which readers only give when a heartbeat asks.
  const double heartbeat_s = delivery.keep_last > 0 ? 0.1 : 0.005;
  qos.reliable_writer_qos().times.heartbeatPeriod = eprosima::fastrtps::Duration_t(heartbeat_s);
  qos.publish_mode().kind =
      delivery.background ? ASYNCHRONOUS_PUBLISH_MODE : SYNCHRONOUS_PUBLISH_MODE;
  if (delivery.background) {
    qos.publish_mode().flow_controller_name = kBackground;
  }
  return qos;
}

DataReaderQos Participant::reader_qos(const std::string& topic, const Delivery& delivery) const {
  DataReaderQos qos = impl_->subscriber->get_default_datareader_qos();
  if (impl_->subscriber->get_datareader_qos_from_profile(topic, qos) == ReturnCode_t::RETCODE_OK) {
    lift_limits(delivery, qos);
    return qos;
  }
  apply(delivery, qos);
  return qos;
}

DataReader* Participant::make_reader(Subscriber& subscriber, Topic& topic, const DataReaderQos& qos,
                                     DataReaderListener& listener) {
  if (within_bus_log()) {
    throw InputError("topic " + topic.get_name() +
                     ": the function given to set_bus_log must not make a reader");
  }
  const std::lock_guard<std::mutex> lock(impl_->making_readers);
  return subscriber.create_datareader(&topic, qos, &listener);
}

void Participant::delete_reader(Subscriber& subscriber, DataReader& reader) {
  if (within_bus_log()) {
    log_error(
        "topic {}: the function given to set_bus_log must not delete a reader: both may wait "
        "for each other for ever",
        reader.get_topicdescription()->get_name());
  }
  reader.set_listener(nullptr);
  const std::lock_guard<std::mutex> lock(impl_->making_readers);
  subscriber.delete_datareader(&reader);
}

double Participant::still_s() const { return impl_->discovery.still_s(); }
bool Participant::hangs() const { return impl_->discovery.hangs(); }
std::uint64_t Participant::stalls() const { return impl_->discovery.stalls(); }

DomainParticipant* Participant::get() const { return impl_->participant; }
Publisher* Participant::publisher() const { return impl_->publisher; }
Subscriber* Participant::subscriber() const { return impl_->subscriber; }

}  // namespace pocd::dds

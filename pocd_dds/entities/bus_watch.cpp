#include "pocd_dds/entities/bus_watch.hpp"

#include <fastdds/rtps/builtin/data/ParticipantProxyData.h>
#include <fastdds/rtps/builtin/data/ReaderProxyData.h>
#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <algorithm>
#include <utility>

namespace pocd::dds {

namespace rtps = eprosima::fastrtps::rtps;
namespace fdds = eprosima::fastdds::dds;

namespace {

ParticipantKey key_of(const rtps::GuidPrefix_t& prefix) {
  ParticipantKey key{};
  std::copy(prefix.value, prefix.value + key.size(), key.begin());
  return key;
}

/// Of a WriterProxyData or a ReaderProxyData.
template <class Proxy>
BusEvent endpoint_event(const Proxy& proxy, bool writer, bool gone) {
  BusEvent event;
  event.kind = gone ? BusEvent::Kind::kEndpointGone : BusEvent::Kind::kEndpoint;
  const rtps::GUID_t& guid = proxy.guid();
  event.participant = key_of(guid.guidPrefix);
  auto& key = event.endpoint.key;
  std::copy(event.participant.begin(), event.participant.end(), key.begin());
  std::copy(guid.entityId.value, guid.entityId.value + 4, key.begin() + 12);
  event.endpoint.writer = writer;
  if (gone) return event;
  event.endpoint.topic = proxy.topicName().to_string();
  event.endpoint.type = proxy.typeName().to_string();
  event.endpoint.keyed = proxy.topicKind() == rtps::WITH_KEY;
  event.endpoint.reliable = proxy.m_qos.m_reliability.kind == fdds::RELIABLE_RELIABILITY_QOS;
  event.endpoint.transient_local =
      proxy.m_qos.m_durability.kind >= fdds::TRANSIENT_LOCAL_DURABILITY_QOS;
  event.endpoint.partitions = proxy.m_qos.m_partition.names();
  return event;
}

}  // namespace

std::vector<BusEvent> BusWatch::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(events_, {});
}

void BusWatch::set_wake(std::function<void()> wake) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wake_ = std::move(wake);
}

void BusWatch::add(BusEvent event) {
  const std::lock_guard<std::mutex> lock(mutex_);
  events_.push_back(std::move(event));
  if (wake_) wake_();
}

void BusWatch::on_publisher_discovery(fdds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) {
  const bool gone = info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER;
  if (gone || info.status == rtps::WriterDiscoveryInfo::DISCOVERED_WRITER) {
    add(endpoint_event(info.info, true, gone));
  }
}

void BusWatch::on_subscriber_discovery(fdds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) {
  const bool gone = info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER;
  if (gone || info.status == rtps::ReaderDiscoveryInfo::DISCOVERED_READER) {
    add(endpoint_event(info.info, false, gone));
  }
}

void BusWatch::on_participant_discovery(fdds::DomainParticipant*,
                                        rtps::ParticipantDiscoveryInfo&& info) {
  using Info = rtps::ParticipantDiscoveryInfo;
  BusEvent event;
  switch (info.status) {
    case Info::DISCOVERED_PARTICIPANT:
      event.kind = BusEvent::Kind::kParticipant;
      break;
    case Info::REMOVED_PARTICIPANT:
      event.kind = BusEvent::Kind::kParticipantLeft;
      break;
    case Info::DROPPED_PARTICIPANT:
      event.kind = BusEvent::Kind::kParticipantLost;
      break;
    default:
      return;
  }
  event.participant = key_of(info.info.m_guid.guidPrefix);
  event.participant_name = info.info.m_participantName.to_string();
  event.lease_s = static_cast<double>(info.info.m_leaseDuration.to_ns()) * 1e-9;
  add(std::move(event));
}

}  // namespace pocd::dds

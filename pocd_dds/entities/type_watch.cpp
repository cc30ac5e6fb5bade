#include "pocd_dds/entities/type_watch.hpp"

#include <fastdds/rtps/builtin/data/ParticipantProxyData.h>
#include <fastdds/rtps/builtin/data/ReaderProxyData.h>
#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <algorithm>
#include <utility>

#include "pocd_dds/entities/idl_version.hpp"

namespace pocd::dds {

namespace rtps = eprosima::fastrtps::rtps;
namespace fdds = eprosima::fastdds::dds;

std::optional<std::string> TypeWatch::other_version(const Guid& endpoint) const {
  if (!any_) return std::nullopt;
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = others_.find(endpoint);
  if (known == others_.end()) return std::nullopt;
  return known->second;
}

/// Of a WriterProxyData or a ReaderProxyData.
template <class Proxy>
void TypeWatch::hear(const Proxy& proxy, bool gone) {
  const rtps::GUID_t& guid = proxy.guid();
  Guid key{};
  std::copy(guid.guidPrefix.value, guid.guidPrefix.value + 12, key.begin());
  std::copy(guid.entityId.value, guid.entityId.value + 4, key.begin() + 12);
  if (gone) {
    if (!any_) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    others_.erase(key);
    any_ = !others_.empty();
    return;
  }
  const std::optional<std::string> announced = announced_idl(proxy.m_qos.m_userData.data_vec());
  if (!announced) return;
  const std::string type = proxy.typeName().to_string();
  const std::string own = idl_version(type);
  if (own.empty() || own == *announced) return;
  Prefix prefix{};
  std::copy(guid.guidPrefix.value, guid.guidPrefix.value + 12, prefix.begin());
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto name = names_.find(prefix);
  others_[key] = "participant \"" + (name != names_.end() ? name->second : "") + "\" has version " +
                 *announced + " of type " + type + ", this one " + own +
                 ": build both from the same IDL";
  any_ = true;
}

void TypeWatch::on_publisher_discovery(fdds::DomainParticipant* participant,
                                       rtps::WriterDiscoveryInfo&& info) {
  const bool gone = info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER;
  if (gone || info.status == rtps::WriterDiscoveryInfo::DISCOVERED_WRITER) hear(info.info, gone);
  if (next_ != nullptr) next_->on_publisher_discovery(participant, std::move(info));
}

void TypeWatch::on_subscriber_discovery(fdds::DomainParticipant* participant,
                                        rtps::ReaderDiscoveryInfo&& info) {
  const bool gone = info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER;
  if (gone || info.status == rtps::ReaderDiscoveryInfo::DISCOVERED_READER) hear(info.info, gone);
  if (next_ != nullptr) next_->on_subscriber_discovery(participant, std::move(info));
}

void TypeWatch::on_participant_discovery(fdds::DomainParticipant* participant,
                                         rtps::ParticipantDiscoveryInfo&& info) {
  using Info = rtps::ParticipantDiscoveryInfo;
  Prefix prefix{};
  const auto& value = info.info.m_guid.guidPrefix.value;
  std::copy(value, value + prefix.size(), prefix.begin());
  if (info.status == Info::DISCOVERED_PARTICIPANT) {
    const std::lock_guard<std::mutex> lock(mutex_);
    names_[prefix] = info.info.m_participantName.to_string();
  } else if (info.status == Info::REMOVED_PARTICIPANT || info.status == Info::DROPPED_PARTICIPANT) {
    const std::lock_guard<std::mutex> lock(mutex_);
    names_.erase(prefix);
  }
  if (next_ != nullptr) next_->on_participant_discovery(participant, std::move(info));
}

}  // namespace pocd::dds

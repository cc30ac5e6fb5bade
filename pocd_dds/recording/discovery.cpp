#include "pocd_dds/recording/discovery.hpp"

#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <utility>

namespace pocd::dds {

using eprosima::fastrtps::rtps::WriterDiscoveryInfo;
using eprosima::fastrtps::rtps::WriterProxyData;
namespace fdds = eprosima::fastdds::dds;

std::vector<RecordedTopic> Discovery::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(announced_, {});
}

void Discovery::on_publisher_discovery(fdds::DomainParticipant*, WriterDiscoveryInfo&& info) {
  if (info.status != WriterDiscoveryInfo::DISCOVERED_WRITER &&
      info.status != WriterDiscoveryInfo::CHANGED_QOS_WRITER) {
    return;
  }
  const WriterProxyData& writer = info.info;
  RecordedTopic topic;
  topic.name = writer.topicName().to_string();
  topic.type = writer.typeName().to_string();
  topic.keyed = writer.topicKind() == eprosima::fastrtps::rtps::WITH_KEY;
  topic.reliable = writer.m_qos.m_reliability.kind == fdds::RELIABLE_RELIABILITY_QOS;
  topic.transient_local = writer.m_qos.m_durability.kind >= fdds::TRANSIENT_LOCAL_DURABILITY_QOS;
  topic.exclusive = writer.m_qos.m_ownership.kind == fdds::EXCLUSIVE_OWNERSHIP_QOS;
  topic.partitions = writer.m_qos.m_partition.names();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    announced_.push_back(std::move(topic));
  }
  wake_();
}

}  // namespace pocd::dds

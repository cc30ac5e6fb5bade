// A topic on the bus, and how a recording writes it down.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pocd/recording/recording_reader.hpp"
#include "pocd_dds/entities/known_types.hpp"
#include "pocd_dds/recording/raw_type.hpp"

namespace pocd::dds {

/// Name, type and quality of service as the bus announces them.
struct RecordedTopic {
  std::string name;  ///< "rt/robot1/odom"
  std::string type;  ///< "nav_msgs::msg::dds_::Odometry_"
  bool keyed = false;
  bool reliable = true;
  bool transient_local = false;
  bool exclusive = false;
  std::vector<std::string> partitions;
};

/// How to tell the instances of a type; empty when its IDL is not known.
KeyOf key_of(const std::string& dds_type);

/// "rt/a" -> "/a"; other names stay.
std::string recorded_name(const std::string& dds_topic);
/// ros2msg of ROS types, omgidl of ours, and only the name of others.
recording::SchemaText schema_of(const RecordedTopic& topic);
std::map<std::string, std::string> metadata_of(const RecordedTopic& topic);

/// Topics that everybody latches, for recordings that say nothing of it.
bool is_latched_by_custom(const std::string& topic);

/// In the metadata of a channel that the recorder has made of another one, whose name it is: it was
/// on no bus and is not played.
inline constexpr const char* kMadeOf = "made_of";
/// The topic of a channel, by what this program, eProsima's recorder or rosbag2 wrote. Nothing for
/// a channel that is not cdr or was made of another one.
std::optional<RecordedTopic> topic_of(const recording::RecordedChannel& channel);

/// Changes of a keyed topic's instances have a channel of their own (pocd_msgs InstanceChange).
std::string instances_name(const RecordedTopic& topic);
recording::SchemaText instances_schema();
/// Name of the recorded topic that a channel has the changes of; "" for other channels.
std::string instances_of(const recording::RecordedChannel& channel);

enum class InstanceChange : std::uint8_t { kWritten = 0, kDisposed = 1, kUnregistered = 2 };
recording::Bytes instance_payload(InstanceChange change, const InstanceKey& key);
/// Throws DamagedData.
std::pair<InstanceChange, InstanceKey> parse_instance(const std::uint8_t* data, std::size_t size);

/// ROS 2's own bookkeeping and services: played again, they would make nodes that are not there.
bool is_of_the_ros_graph(const std::string& dds_topic);

/// Shell pattern (*, ?, [..]) against the recorded name or the name on the bus.
bool topic_matches(const std::string& pattern, const RecordedTopic& topic);

}  // namespace pocd::dds

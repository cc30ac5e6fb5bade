#include "pocd_dds/recording/recorded_topic.hpp"

#include <fnmatch.h>
#include <strings.h>

#include <algorithm>

#include "pocd/input/suggest_input.hpp"
#include "pocd/recording/cdr.hpp"

namespace pocd::dds {
namespace {

using recording::RecordedChannel;
using recording::SchemaText;

constexpr char kRosPrefix[] = "rt/";
constexpr char kInstances[] = "pocd_msgs::msg::InstanceChange";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

bool is_ours(const std::string& plain) { return plain.rfind("pocd_msgs::", 0) == 0; }

/// Enumerations as rosbag2 writes them; history and depth are not announced on the bus.
std::string offered_qos_profiles(const RecordedTopic& topic) {
  const std::string forever = ":\n    sec: 9223372036\n    nsec: 854775807\n";
  return "- history: 3\n  depth: 0\n  reliability: " + std::string(topic.reliable ? "1" : "2") +
         "\n  durability: " + (topic.transient_local ? "1" : "2") + "\n  deadline" + forever +
         "  lifespan" + forever + "  liveliness: 1\n  liveliness_lease_duration" + forever +
         "  avoid_ros_namespace_conventions: false";
}

/// Values behind "key:" in lines of text, one for each writer, without quotes.
std::vector<std::string> values_of(const std::string& text, const std::string& key) {
  std::vector<std::string> values;
  for (std::size_t at = 0; (at = text.find(key + ":", at)) != std::string::npos;) {
    at = text.find_first_not_of(" \"'", at + key.size() + 1);
    if (at == std::string::npos) break;
    values.push_back(text.substr(at, text.find_first_of(" \"',}\r\n", at) - at));
  }
  return values;
}
std::string value_of(const std::string& text, const std::string& key) {
  const std::vector<std::string> values = values_of(text, key);
  return values.empty() ? "" : values.front();
}

/// rosbag2 wrote numbers up to Iron, and names since Jazzy.
bool any_is(const std::vector<std::string>& values, const char* number, const char* name) {
  return std::any_of(values.begin(), values.end(), [&](const std::string& value) {
    return value == number || ::strcasecmp(value.c_str(), name) == 0;
  });
}

std::string metadata(const RecordedChannel& channel, const std::string& key) {
  const auto found = channel.metadata.find(key);
  return found == channel.metadata.end() ? "" : found->second;
}

void read_qos(const RecordedChannel& channel, RecordedTopic& topic) {
  const std::string qos = metadata(channel, "qos");
  const std::string offered = metadata(channel, "offered_qos_profiles");
  if (!qos.empty()) {
    topic.reliable = value_of(qos, "reliability") == "true";
    topic.transient_local = value_of(qos, "durability") == "true";
    topic.exclusive = value_of(qos, "ownership") == "true";
    topic.keyed = value_of(qos, "keyed") == "true";
    return;
  }
  // Of several writers, what satisfies most readers.
  const std::vector<std::string> reliability = values_of(offered, "reliability");
  const std::vector<std::string> durability = values_of(offered, "durability");
  topic.reliable = reliability.empty() ||
                   !std::all_of(reliability.begin(), reliability.end(), [](const auto& value) {
                     return any_is({value}, "2", "best_effort");
                   });
  // Other words (system_default, unknown, best_available) say nothing.
  topic.transient_local =
      any_is(durability, "1", "transient_local") ||
      (!any_is(durability, "2", "volatile") && is_latched_by_custom(channel.topic));
}

/// "rt/a" for "/a"; for a type by its name in ROS the one that it has on the bus.
std::string bus_topic(const std::string& topic) {
  return topic.rfind('/', 0) == 0 ? "rt" + topic : topic;
}
std::string bus_type(const std::string& recorded) {
  if (recorded.find("::dds_::") != std::string::npos) return recorded;
  std::string type = replaced(ros_type_name(recorded), "/", "::");
  const std::size_t at = type.rfind("::");
  return at == std::string::npos ? type : type.substr(0, at) + "::dds_" + type.substr(at) + "_";
}

/// "a|b", or "guid:a|b;guid:a|b" as eProsima's recorder writes them.
std::vector<std::string> read_partitions(std::string text) {
  text = text.substr(0, text.find(';'));
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos) text.erase(0, colon + 1);
  std::vector<std::string> partitions;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('|'), text.size());
    partitions.push_back(text.substr(0, end));
    text.erase(0, end + 1);
  }
  return partitions;
}

}  // namespace

bool is_latched_by_custom(const std::string& topic) {
  const std::string last = topic.substr(topic.rfind('/') + 1);
  return last == "tf_static" || last == "robot_description" || last == "map";
}

KeyOf key_of(const std::string& dds_type) {
  const std::string plain = plain_type(dds_type);
  if (!known_types().has(plain)) return {};
  return [plain](const recording::Bytes& payload) {
    return known_types().key_of(plain, payload.data(), payload.size());
  };
}

std::string recorded_name(const std::string& dds_topic) {
  return dds_topic.rfind(kRosPrefix, 0) == 0 ? dds_topic.substr(2) : dds_topic;
}

SchemaText schema_of(const RecordedTopic& topic) {
  const std::string plain = plain_type(topic.type);
  if (!known_types().has(plain)) {
    const bool ros = plain != topic.type;
    return {ros ? replaced(plain, "::", "/") : plain, "", ""};
  }
  return is_ours(plain) ? known_types().omgidl(plain) : known_types().ros2msg(plain);
}

std::map<std::string, std::string> metadata_of(const RecordedTopic& topic) {
  const auto word = [](bool value) { return value ? "true" : "false"; };
  std::string partitions;
  for (const std::string& partition : topic.partitions) {
    partitions += (partitions.empty() ? "" : "|") + partition;
  }
  const bool ros = recorded_name(topic.name) != topic.name && plain_type(topic.type) != topic.type;
  return {{"offered_qos_profiles", offered_qos_profiles(topic)},
          {"qos", std::string("reliability: ") + word(topic.reliable) +
                      "\ndurability: " + word(topic.transient_local) +
                      "\nownership: " + word(topic.exclusive) + "\nkeyed: " + word(topic.keyed)},
          {"ros2-types", word(ros)},
          {"partitions", partitions},
          {"dds_topic", topic.name},
          {"dds_type", topic.type}};
}

std::optional<RecordedTopic> topic_of(const RecordedChannel& channel) {
  if (channel.message_encoding != "cdr" || !metadata(channel, kMadeOf).empty()) {
    return std::nullopt;
  }
  RecordedTopic topic;
  read_qos(channel, topic);
  topic.partitions = read_partitions(metadata(channel, "partitions"));
  topic.name = metadata(channel, "dds_topic");
  topic.type = metadata(channel, "dds_type");
  if (!topic.name.empty() && !topic.type.empty()) return topic;
  topic.name = channel.topic;
  topic.type = channel.type;
  if (metadata(channel, "ros2-types") == "false") return topic;
  topic.name = bus_topic(channel.topic);
  topic.type = bus_type(channel.type);
  return topic;
}

std::string instances_name(const RecordedTopic& topic) {
  return recorded_name(topic.name) + "/_instances";
}

SchemaText instances_schema() { return known_types().omgidl(kInstances); }

std::string instances_of(const RecordedChannel& channel) {
  return metadata(channel, "instances_of");
}

recording::Bytes instance_payload(InstanceChange change, const InstanceKey& key) {
  recording::CdrWriter out;
  out.number(static_cast<std::uint8_t>(change));
  out.raw(key.data(), key.size());
  return out.bytes();
}

std::pair<InstanceChange, InstanceKey> parse_instance(const std::uint8_t* data, std::size_t size) {
  recording::CdrReader in(data, size);
  const auto change = in.number<std::uint8_t>();
  if (change > 2) throw recording::DamagedData(4, "unknown change of an instance");
  InstanceKey key;
  const std::uint8_t* bytes = in.bytes(key.size());
  std::copy_n(bytes, key.size(), key.begin());
  return {static_cast<InstanceChange>(change), key};
}

bool is_of_the_ros_graph(const std::string& dds_topic) {
  return dds_topic == "ros_discovery_info" || dds_topic.compare(0, 3, "rq/") == 0 ||
         dds_topic.compare(0, 3, "rr/") == 0;
}

bool topic_matches(const std::string& pattern, const RecordedTopic& topic) {
  return ::fnmatch(pattern.c_str(), recorded_name(topic.name).c_str(), 0) == 0 ||
         ::fnmatch(pattern.c_str(), topic.name.c_str(), 0) == 0;
}

}  // namespace pocd::dds

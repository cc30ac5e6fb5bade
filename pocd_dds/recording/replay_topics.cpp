#include "pocd_dds/recording/replay_topics.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>

#include "pocd/common/check.hpp"

namespace pocd::dds {

/// A pattern that matches nothing is a mistake that would show in the map only.
void ReplayTopics::refuse_typos() const {
  if (recorded_.empty()) return;
  const auto names = [&](const auto& list, const auto& name_of) {
    std::set<std::string> unique;
    for (const auto& entry : list) unique.insert(name_of(entry));
    std::string text;
    for (const std::string& name : unique) text += (text.empty() ? "" : ", ") + name;
    return text;
  };
  const auto of_topic = [](const RecordedTopic& topic) { return recorded_name(topic.name); };
  const auto of_entry = [](const auto& entry) { return recorded_name(entry.second.name); };
  for (const std::string& pattern : options_.topics) {
    const bool known = std::any_of(recorded_.begin(), recorded_.end(), [&](const auto& topic) {
      return topic_matches(pattern, topic);
    });
    if (known) continue;
    throw InputError("--topics " + pattern + ": matches none of " + names(recorded_, of_topic));
  }
  for (const auto* patterns : {&options_.latch, &options_.no_latch}) {
    for (const std::string& pattern : *patterns) {
      const bool known = std::any_of(played_.begin(), played_.end(), [&](const auto& entry) {
        return topic_matches(pattern, entry.second);
      });
      if (known) continue;
      throw InputError((patterns == &options_.latch ? "--latch " : "--no-latch ") + pattern +
                       ": matches no topic that is played, only " + names(played_, of_entry));
    }
  }
  for (const auto& [from, to] : options_.remap) {
    const bool known =
        std::any_of(played_.begin(), played_.end(),
                    [&, name = from](const auto& topic) { return of_entry(topic) == name; });
    if (known) continue;
    throw InputError("--remap " + from + ": no such topic is played, only " +
                     names(played_, of_entry));
  }
  for (const std::string& pattern : options_.wait_for) {
    const bool known = std::any_of(played_.begin(), played_.end(), [&](const auto& topic) {
      return topic_matches(pattern, topic.second);
    });
    if (known) continue;
    throw InputError("--wait-for " + pattern + ": matches no topic that is played, only " +
                     names(played_, of_entry));
  }
}

bool ReplayTopics::selected(const RecordedTopic& topic) const {
  if (options_.topics.empty()) {
    const bool graph = is_of_the_ros_graph(topic.name);
    if (graph) spdlog::info("{}: is left out (--topics plays it)", topic.name);
    return !graph;
  }
  return std::any_of(options_.topics.begin(), options_.topics.end(),
                     [&](const std::string& pattern) { return topic_matches(pattern, topic); });
}

RecordedTopic ReplayTopics::renamed(RecordedTopic topic) const {
  const auto to = options_.remap.find(recorded_name(topic.name));
  if (to != options_.remap.end()) {
    topic.name = (to->second.rfind('/', 0) == 0 ? "rt" : "") + to->second;
  }
  return topic;
}

void ReplayTopics::add(const recording::RecordedChannel& channel) {
  if (!instances_of(channel).empty()) return;
  const std::optional<RecordedTopic> topic = topic_of(channel);
  if (!topic) {
    if (channel.message_encoding == "cdr" || !told_.insert(channel.topic).second) return;
    spdlog::warn("{}: is not played: its messages are in \"{}\", only cdr is played{}",
                 channel.topic, channel.message_encoding,
                 channel.message_encoding == "ros1"
                     ? "; a recording of ROS 1 has to be converted (rosbags-convert)"
                     : "");
    return;
  }
  recorded_.push_back(*topic);
  if (!selected(*topic)) return;
  RecordedTopic offered = *topic;
  const auto matches = [&](const std::string& pattern) { return topic_matches(pattern, *topic); };
  if (std::any_of(options_.latch.begin(), options_.latch.end(), matches)) {
    offered.transient_local = offered.reliable = true;
  }
  if (std::any_of(options_.no_latch.begin(), options_.no_latch.end(), matches)) {
    offered.transient_local = false;
  }
  const bool wanted_so = std::any_of(options_.no_latch.begin(), options_.no_latch.end(), matches);
  if (is_latched_by_custom(topic->name) && !offered.transient_local && !wanted_so &&
      told_.insert(topic->name).second) {
    const std::string name = recorded_name(topic->name);
    spdlog::warn(
        "{}: was recorded volatile: who asks for latched messages does not hear it (--latch {})",
        name, name);
  }
  const auto [entry, fresh] = played_.try_emplace({topic->name, topic->partitions}, offered);
  if (!fresh && entry->second.type != topic->type) {
    spdlog::warn("{}: recorded with two types, {} and {}; only the first is played", topic->name,
                 entry->second.type, topic->type);
  }
}

}  // namespace pocd::dds

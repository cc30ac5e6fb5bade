// Which topics of recordings are played, and under which names.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pocd_dds/recording/replayer.hpp"

namespace pocd::dds {

/// Not thread-safe.
class ReplayTopics {
 public:
  /// One line of topic and partitions.
  using Key = std::pair<std::string, std::vector<std::string>>;

  /// `options` must outlive it.
  explicit ReplayTopics(const ReplayOptions& options) : options_(options) {}

  void add(const recording::RecordedChannel& channel);
  /// Once all are added: throws InputError for a pattern or name that matches nothing.
  void refuse_typos() const;

  /// As recorded.
  const std::map<Key, RecordedTopic>& played() const { return played_; }
  /// As it is played.
  RecordedTopic renamed(RecordedTopic topic) const;

 private:
  bool selected(const RecordedTopic& topic) const;

  const ReplayOptions& options_;
  std::vector<RecordedTopic> recorded_;  // selected or not
  std::map<Key, RecordedTopic> played_;
  std::set<std::string> told_;  // topics that something was said about
};

}  // namespace pocd::dds

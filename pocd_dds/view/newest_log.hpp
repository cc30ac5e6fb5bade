// A log of which only the newest entry of each key is kept: a reader that is slow skips what is out
// of date, and needs no queue of its own but the number it has read up to.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

namespace pocd::view {

/// Revisions are 1, 2, ... in the order of writing. Not thread-safe.
template <class Key, class Value>
class NewestLog {
 public:
  struct Entry {
    std::uint64_t revision = 0;
    Value value;
  };

  void put(const Key& key, Value value) {
    const auto found = entries_.find(key);
    if (found != entries_.end()) by_revision_.erase(found->second.revision);
    const std::uint64_t revision = ++newest_;
    by_revision_[revision] = key;
    entries_[key] = {revision, std::move(value)};
  }
  /// Readers that have not read up to it are told by pruned().
  void forget(const Key& key) {
    const auto found = entries_.find(key);
    if (found == entries_.end()) return;
    if (found->second.revision > pruned_) pruned_ = found->second.revision;
    by_revision_.erase(found->second.revision);
    entries_.erase(found);
  }

  /// The first entry after `revision`: its key and entry, or null at the end.
  std::pair<const Key*, const Entry*> after(std::uint64_t revision) const {
    const auto next = by_revision_.upper_bound(revision);
    if (next == by_revision_.end()) return {nullptr, nullptr};
    return {&next->second, &entries_.at(next->second)};
  }
  const Entry* find(const Key& key) const {
    const auto found = entries_.find(key);
    return found == entries_.end() ? nullptr : &found->second;
  }
  std::uint64_t newest() const { return newest_; }
  /// A reader that stopped before this revision may have missed something that is not here any
  /// more.
  std::uint64_t pruned() const { return pruned_; }
  std::size_t size() const { return entries_.size(); }

 private:
  std::uint64_t newest_ = 0, pruned_ = 0;
  std::map<Key, Entry> entries_;
  std::map<std::uint64_t, Key> by_revision_;
};

}  // namespace pocd::view

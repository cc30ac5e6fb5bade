// What is kept per robot, for as long as the robot is heard of.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "pocd/common/types.hpp"

namespace pocd {

/// A value per name. Names that were not asked for within `keep_ns` of the data's time, and beyond
/// `most` names the one that was not asked for longest, are forgotten when a new name comes: memory
/// is bounded whatever names come. Not thread-safe.
template <class T>
class RecentMap {
 public:
  explicit RecentMap(StampNs keep_ns = 600'000'000'000, std::size_t most = 1024)
      : keep_ns_(keep_ns), most_(most) {}

  /// The name's value, and whether it was made just now.
  std::pair<T&, bool> at(const std::string& name, StampNs now_ns) {
    auto found = entries_.find(name);
    if (found != entries_.end() && away(found->second, now_ns)) {
      entries_.erase(found);
      found = entries_.end();
    }
    const bool fresh = found == entries_.end();
    if (fresh) {
      forget(now_ns);
      found = entries_.try_emplace(name).first;
    }
    found->second.used_ns = now_ns;
    found->second.order = ++order_;
    return {found->second.value, fresh};
  }
  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    T value{};
    StampNs used_ns = 0;
    std::uint64_t order = 0;
  };
  /// Of stamps far apart in either direction: clocks may have been set back.
  bool away(const Entry& entry, StampNs now_ns) const {
    return entry.used_ns < now_ns ? now_ns - entry.used_ns > keep_ns_
                                  : entry.used_ns - now_ns > keep_ns_;
  }
  void forget(StampNs now_ns) {
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      entry = away(entry->second, now_ns) ? entries_.erase(entry) : std::next(entry);
    }
    if (entries_.size() < most_) return;
    entries_.erase(std::min_element(entries_.begin(), entries_.end(), [](auto& a, auto& b) {
      return a.second.order < b.second.order;
    }));
  }

  StampNs keep_ns_;
  std::size_t most_;
  std::uint64_t order_ = 0;
  std::map<std::string, Entry> entries_;
};

}  // namespace pocd

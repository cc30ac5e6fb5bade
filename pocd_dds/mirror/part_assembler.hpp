// Steps of the map from the parts that they were cut into.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <vector>

namespace pocd::dds {

/// `Message` has part() and part_count(). Parts may come twice and in any order. Of steps that lack
/// parts, the `kMostOpen` that grew last are kept. Not thread-safe.
template <class Key, class Message>
class PartAssembler {
 public:
  /// All parts, in order, when this one was the last that lacked.
  std::optional<std::vector<Message>> add(const Key& key, const Message& message) {
    const std::uint32_t count = message.part_count();
    if (count == 0 || count > kMostParts || message.part() >= count) return std::nullopt;
    Step& step = open_[key];
    step.grew = ++turn_;
    std::vector<std::optional<Message>>& parts = step.parts;
    if (parts.empty()) parts.resize(count);
    if (parts.size() != count) return std::nullopt;
    parts[message.part()] = message;
    for (const auto& part : parts) {
      if (!part) {
        if (open_.size() > kMostOpen) drop_oldest();
        return std::nullopt;
      }
    }
    std::vector<Message> complete;
    for (auto& part : parts) complete.push_back(std::move(*part));
    open_.erase(key);
    return complete;
  }

  /// Drops the open steps whose key is none of those wanted.
  template <class Wanted>
  void keep(const Wanted& wanted) {
    for (auto step = open_.begin(); step != open_.end();) {
      step = wanted(step->first) ? std::next(step) : open_.erase(step);
    }
  }

 private:
  struct Step {
    std::vector<std::optional<Message>> parts;
    std::uint64_t grew = 0;
  };
  void drop_oldest() {
    open_.erase(std::min_element(open_.begin(), open_.end(), [](const auto& a, const auto& b) {
      return a.second.grew < b.second.grew;
    }));
  }

  static constexpr std::size_t kMostOpen = 16;
  static constexpr std::uint32_t kMostParts = 100000;
  std::map<Key, Step> open_;
  std::uint64_t turn_ = 0;
};

}  // namespace pocd::dds

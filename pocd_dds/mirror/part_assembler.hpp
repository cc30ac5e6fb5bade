// Steps of the map from the parts that they were cut into.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace pocd::dds {

/// `Message` has part() and part_count(). Parts may come twice and in any order; the messages of
/// `kMostOpen` steps are kept at most. Not thread-safe.
template <class Key, class Message>
class PartAssembler {
 public:
  /// All parts, in order, when this one was the last that lacked.
  std::optional<std::vector<Message>> add(const Key& key, const Message& message) {
    const std::uint32_t count = message.part_count();
    if (count == 0 || count > kMostParts || message.part() >= count) return std::nullopt;
    std::vector<std::optional<Message>>& parts = open_[key];
    if (parts.empty()) parts.resize(count);
    if (parts.size() != count) return std::nullopt;
    parts[message.part()] = message;
    for (const auto& part : parts) {
      if (!part) {
        if (open_.size() > kMostOpen) open_.erase(open_.begin());
        return std::nullopt;
      }
    }
    std::vector<Message> complete;
    for (auto& part : parts) complete.push_back(std::move(*part));
    open_.erase(key);
    return complete;
  }

 private:
  static constexpr std::size_t kMostOpen = 16;
  static constexpr std::uint32_t kMostParts = 100000;
  std::map<Key, std::vector<std::optional<Message>>> open_;
};

}  // namespace pocd::dds

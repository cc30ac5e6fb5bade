#include "pocd/input/robot_topic.hpp"

#include <algorithm>

namespace pocd {
namespace {

const std::string kKey = "{robot}";

}  // namespace

std::string robot_topic(const std::string& pattern, const std::string& robot) {
  std::string name = pattern;
  for (std::size_t at = name.find(kKey); at != std::string::npos; at = name.find(kKey, at)) {
    name.replace(at, kKey.size(), robot);
    at += robot.size();
  }
  return name;
}

std::optional<std::string> robot_in(const std::string& pattern, const std::string& topic) {
  const std::size_t at = pattern.find(kKey);
  if (at == std::string::npos) {
    return topic == pattern ? std::optional<std::string>("") : std::nullopt;
  }
  if (topic.compare(0, at, pattern, 0, at) != 0) return std::nullopt;
  // A name has no '/', so the first one ends it, unless the pattern goes on within the segment.
  const std::string tail = pattern.substr(at + kKey.size());
  const std::string rest = topic.substr(std::min(at, topic.size()));
  const std::size_t longest = std::min(rest.find('/'), rest.size());
  for (std::size_t length = longest; length > 0; --length) {
    const std::string name = rest.substr(0, length);
    if (rest.compare(length, std::string::npos, robot_topic(tail, name)) == 0) return name;
  }
  return std::nullopt;
}

}  // namespace pocd

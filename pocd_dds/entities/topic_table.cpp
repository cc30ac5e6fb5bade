#include "pocd_dds/entities/topic_table.hpp"

namespace pocd::dds {

std::string robot_topic(const std::string& pattern, const std::string& robot) {
  const std::string key = "{robot}";
  std::string name = pattern;
  for (std::size_t at = name.find(key); at != std::string::npos; at = name.find(key, at)) {
    name.replace(at, key.size(), robot);
    at += robot.size();
  }
  return name;
}

}  // namespace pocd::dds

#include "pocd_dds/watch/health_line.hpp"

namespace pocd::dds {
namespace {

/// What it waits for, of those robots that do not deliver: "robot1: waiting for odom since 12.3".
std::string waiting(const pocd_msgs::msg::NodeHealth& health) {
  std::string text;
  for (const auto& robot : health.robots()) {
    if (robot.frames() > 0 && robot.waiting_for().empty()) continue;
    text += text.empty() ? "" : "; ";
    text += robot.name() + ": ";
    text += robot.waiting_for().empty() ? "waiting for its first frame" : robot.waiting_for();
  }
  return text;
}

}  // namespace

std::string health_line(const pocd_msgs::msg::NodeHealth& health) {
  const std::string waits_for = waiting(health);
  return health.name() + (health.level() < 2 ? " is up: " : " fails: ") + health.message() +
         (waits_for.empty() ? "" : ", " + waits_for) + ", " +
         std::to_string(health.frames_processed()) + " frames processed, " +
         std::to_string(health.frames_dropped()) + " dropped, " + std::to_string(health.objects()) +
         " objects, map version " + std::to_string(health.map_version());
}

}  // namespace pocd::dds

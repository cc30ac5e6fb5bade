// What is said about objects, events, robots and the node, as JSON. Lengths in metres, angles in
// radians, stamps in seconds of the data's clock, all in the map frame. docs/view.md lists the
// fields.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "pocd_dds/object_watch.hpp"
#include "pocd_msgs.h"
#include "view/history.hpp"

namespace pocd::view {

using Json = nlohmann::json;

/// A robot's camera in the map.
struct RobotPose {
  std::string name;
  StampNs stamp_ns = 0;  ///< of its image
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  std::array<double, 4> view{};  ///< tangents of the view's sides: left, right, up, down
};

std::string hex(const std::array<std::uint8_t, 16>& uuid);
std::string hex(std::uint64_t number);
/// Text of peers may be no UTF-8; such bytes become U+FFFD.
std::string text_of(const Json& json);

double seconds(StampNs stamp_ns);
/// x, y, z of the centre, heading, size along, across and up.
Json box_json(const OrientedBox& box);
Json belief_json(const Belief& belief);
Json object_json(const WatchedObject& object, std::uint32_t run, const std::string& condition);
Json event_json(const pocd_msgs::msg::ObjectEvent& message, std::uint64_t number,
                std::uint32_t run);
Json robot_json(const RobotPose& pose);
/// The status of what is played: it is in step with itself. `kind`: recording or memory; `read`:
/// the share that has been read; `problem`: what is damaged, or empty.
Json played_json(const std::string& kind, const std::string& name, double read,
                 const std::string& problem);
Json health_json(const pocd_msgs::msg::NodeHealth& health, const std::string& condition);
Json sample_json(const ObjectSample& sample);
Json record_json(const std::string& uuid, const History::Record& record);

}  // namespace pocd::view

// Small messages that larger ones are made of.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

#include "geometry_msgs.h"
#include "pocd_dds/bridge/conversions.hpp"

namespace pocd::dds {

std_msgs::msg::Header header_of(StampNs stamp_ns, const std::string& frame_id);
geometry_msgs::msg::Point point_of(const Eigen::Vector3d& p);
geometry_msgs::msg::Quaternion quaternion_of(const Eigen::Quaterniond& q);
geometry_msgs::msg::Vector3 vector_of(const Eigen::Vector3d& v);

}  // namespace pocd::dds

// Between the messages of sensors and robots and the core's types. This folder is the only place
// that knows both worlds; object_messages.hpp and map_messages.hpp have what the node says.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "geometry_msgs.h"
#include "nav_msgs.h"
#include "pocd/input/message_checks.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "sensor_msgs.h"
#include "tf2_msgs.h"

namespace pocd::dds {

StampNs to_stamp(const builtin_interfaces::msg::Time& time);
builtin_interfaces::msg::Time to_time(StampNs stamp_ns);

// ---- input: pocd/input/message_checks.hpp says what is accepted; images: image_visit.hpp ----

Checked<CameraModel> camera_from(const sensor_msgs::msg::CameraInfo& info);

Checked<StampedTransform> transform_from(const nav_msgs::msg::Odometry& odometry);
Checked<StampedTransform> transform_from(const geometry_msgs::msg::TransformStamped& transform);

// ---- what pocd_play sends ----

sensor_msgs::msg::Image image_message(const cv::Mat& image, const std::string& encoding,
                                      StampNs stamp_ns, const std::string& frame_id);
sensor_msgs::msg::CameraInfo camera_message(const CameraModel& camera, StampNs stamp_ns,
                                            const std::string& frame_id);
nav_msgs::msg::Odometry odometry_message(const StampedTransform& transform);
geometry_msgs::msg::TransformStamped transform_message(const StampedTransform& transform);

}  // namespace pocd::dds

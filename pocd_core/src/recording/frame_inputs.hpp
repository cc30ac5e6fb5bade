// From decoded messages to what the synchroniser takes, with the checks and the meaning that the
// component gives them on the bus.
#pragma once

#include <map>
#include <opencv2/core/mat.hpp>

#include "pocd/input/camera_model.hpp"
#include "pocd/recording/ros_messages.hpp"
#include "pocd/segmentation/class_map.hpp"

namespace pocd::recording {

/// Pixel value of a colour in rgb8 masks.
using ColourValues = std::map<std::uint32_t, std::uint16_t>;  // by r << 16 | g << 8 | b
ColourValues colour_values(const ClassMap& classes);

/// All copy, and throw InputError naming field and value. 16UC1 or mono16 [mm], 32FC1 [m].
cv::Mat depth_image(const RosImage& image);
/// mono8, 8UC1, mono16, 16UC1, or rgb8, bgr8 by `colours` (others become 0) -> CV_16UC1.
cv::Mat label_image(const RosImage& image, const ColourValues& colours);
/// rgb8, bgr8 -> CV_8UC3 BGR.
cv::Mat color_image(const RosImage& image);
CameraModel camera_model(const RosCameraInfo& info);
/// Checks names, values and the length of the quaternion; one that is off a little is corrected.
RosTransform checked_transform(RosTransform transform);

}  // namespace pocd::recording

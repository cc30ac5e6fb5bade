// One registered RGB-D frame with pose: the only thing the pipeline is fed, whoever made it.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "pocd/common/types.hpp"
#include "pocd/input/camera_model.hpp"

namespace pocd {

/// A frame owns its images by cv::Mat reference count. Images share one size, the camera's.
struct Frame {
  StampNs stamp_ns = 0;
  /// Number of the frame within its source (0, 1, ...); for messages and events only.
  std::uint64_t sequence = 0;
  /// Namespace of the robot that saw it; "" for a single data set.
  std::string robot;
  /// Which of the robot's cameras took it: its frame in the transforms; "" where there is only one.
  std::string camera_frame;
  CameraModel camera;
  Pose T_W_C = Pose::Identity();
  /// CV_32FC1 [m]; 0 or NaN = no return. make_frame converts from millimetres.
  cv::Mat depth_m;
  /// CV_16UC1 class index per pixel (times the label divisor plus instance, if configured), or
  /// empty: then every pixel has the configured default class.
  cv::Mat labels;
  /// CV_8UC3 BGR or empty.
  cv::Mat color;
};

/// How a depth image codes its values.
enum class DepthEncoding { kMillimetres16U, kMetres32F };

/// Builds a frame and converts depth to metres: 0, 65535 (16 bit), negative, infinite and NaN
/// become "no return" (0). Throws InputError, naming `source`, the field and the value, when sizes
/// disagree, a type is none of the documented ones, the camera is invalid, or the pose is not
/// finite and rigid.
Frame make_frame(StampNs stamp_ns, const CameraModel& camera, const Pose& T_W_C,
                 const cv::Mat& depth, const cv::Mat& labels, const cv::Mat& color,
                 const std::string& source);

/// Throws InputError unless T is finite, its rotation orthonormal within 1e-3, and its translation
/// at most 50 km: points are kept in single precision, which tells 4 mm apart there.
void validate_pose(const Pose& T, const std::string& source);

/// Throws InputError, naming `source`, the field and the value, unless make_frame could have made
/// the frame; depths are not looked at.
void validate_frame(const Frame& frame, const std::string& source);

}  // namespace pocd

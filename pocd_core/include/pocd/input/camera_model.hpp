// Pinhole camera without distortion (images are rectified before they get here).
#pragma once

#include <Eigen/Core>
#include <string>

namespace pocd {

/// Intrinsics [pixels]. Optical frame: x right, y down, z forward. The centre of the top left pixel
/// is (0, 0).
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;

  bool operator==(const CameraModel& o) const {
    return width == o.width && height == o.height && fx == o.fx && fy == o.fy && cx == o.cx &&
           cy == o.cy;
  }
  bool operator!=(const CameraModel& o) const { return !(*this == o); }

  /// Point of pixel (u, v) at depth z [m] in the optical frame.
  Eigen::Vector3d back_project(double u, double v, double z) const {
    return {(u - cx) / fx * z, (v - cy) / fy * z, z};
  }
};

/// No image is larger, whoever announces it.
inline constexpr int kLargestSide_px = 16384;

/// "" or the first field that no camera has, with its value and the rule: sizes are in
/// [1, kLargestSide_px];
/// all intrinsics are finite; a focal length is 1/20 to 100 times its side of the image; the
/// principal point lies at most one image beyond the border. What a frame costs is bounded by that.
std::string camera_fault(const CameraModel& camera);

/// Throws InputError with `source` and the fault, if there is one.
void validate(const CameraModel& camera, const std::string& source);

}  // namespace pocd

#include "pocd/input/message_checks.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace pocd {
namespace {

// As tf2 does: of the square of the length.
constexpr double kUnitTolerance = 0.01;
// Of a field that is text from the bus, in a message about it.
constexpr std::size_t kLongestQuote = 64;

std::string text(double value) { return std::to_string(value); }
std::string quoted(std::string_view value) {
  return "\"" + std::string(value.substr(0, kLongestQuote)) + "\"";
}

/// One side of the image that is sent: of the region of interest, binned.
std::uint32_t sent_side(std::uint32_t full, std::uint32_t roi, std::uint32_t binning) {
  return (roi == 0 ? full : roi) / std::max(binning, 1u);
}

struct Intrinsics {
  double fx, fy, cx, cy;
};
Intrinsics intrinsics_of(const CameraInfoFields& info) {
  const Intrinsics lens{info.k[0], info.k[4], info.k[2], info.k[5]};
  const Intrinsics rectified{info.p[0], info.p[5], info.p[2], info.p[6]};
  const auto usable = [](const Intrinsics& i) {
    return i.fx > 0.0 && i.fy > 0.0 && std::isfinite(i.fx + i.fy + i.cx + i.cy);
  };
  return info.distorted && usable(lens) && usable(rectified) ? rectified : lens;
}

}  // namespace

Checked<CameraModel> camera_model(const CameraInfoFields& info) {
  const std::uint32_t width = sent_side(info.width, info.roi_width, info.binning_x);
  const std::uint32_t height = sent_side(info.height, info.roi_height, info.binning_y);
  if (width == 0 || height == 0 || info.width > kLargestSide_px || info.height > kLargestSide_px ||
      width > kLargestSide_px || height > kLargestSide_px) {
    return {InputReason::kBadImageSize,
            "camera info is for " + std::to_string(info.width) + "x" + std::to_string(info.height)};
  }
  const Intrinsics full = intrinsics_of(info);
  for (const double value : {full.fx, full.fy, full.cx, full.cy}) {
    if (!std::isfinite(value)) return {InputReason::kNotFinite, "k has a value that is not finite"};
  }
  CameraModel camera;
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  const double bin_x = std::max(info.binning_x, 1u), bin_y = std::max(info.binning_y, 1u);
  camera.fx = full.fx / bin_x;
  camera.cx = (full.cx - info.roi_x) / bin_x;
  camera.fy = full.fy / bin_y;
  camera.cy = (full.cy - info.roi_y) / bin_y;
  if (camera.fx <= 0.0 || camera.fy <= 0.0) {
    return {InputReason::kZeroFocalLength, "fx = " + text(camera.fx) + ", fy = " + text(camera.fy) +
                                               ": is the camera not calibrated?"};
  }
  if (auto fault = camera_fault(camera); !fault.empty()) {
    return {InputReason::kBadIntrinsics, std::move(fault)};
  }
  return camera;
}

std::string frame_name(std::string name) {
  if (!name.empty() && name[0] == '/') name.erase(0, 1);
  return name;
}

Checked<StampedTransform> checked_transform(StampedTransform transform) {
  transform.parent = frame_name(std::move(transform.parent));
  transform.child = frame_name(std::move(transform.child));
  if (transform.parent.empty() || transform.child.empty()) {
    return {InputReason::kEmptyFrameName,
            "frame_id " + quoted(transform.parent) + ", child_frame_id " + quoted(transform.child)};
  }
  if (transform.parent == transform.child) {
    return {InputReason::kTransformLoop,
            "frame_id and child_frame_id are both " + quoted(transform.child)};
  }
  const Eigen::Vector3d& position = transform.T.position;
  const Eigen::Vector4d xyzw = transform.T.rotation.coeffs();
  if (!position.allFinite() || !xyzw.allFinite()) {
    return {InputReason::kNotFinite, "position " + text(position.x()) + " " + text(position.y()) +
                                         " " + text(position.z()) + ", quaternion xyzw " +
                                         text(xyzw[0]) + " " + text(xyzw[1]) + " " + text(xyzw[2]) +
                                         " " + text(xyzw[3])};
  }
  const double norm = xyzw.norm();
  if (std::abs(norm * norm - 1.0) > kUnitTolerance) {
    return {InputReason::kNonUnitQuaternion, "quaternion has length " + text(norm)};
  }
  // A unit quaternion keeps its bits; only one that is off is corrected.
  if (std::abs(norm - 1.0) > 1e-12) transform.T.rotation.normalize();
  return transform;
}

}  // namespace pocd

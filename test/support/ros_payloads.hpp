// Payloads of the ROS messages that frames are made of, as a sender would write them.
#pragma once

#include <algorithm>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "pocd/input/camera_model.hpp"
#include "pocd/input/pose_quaternion.hpp"
#include "pocd/input/transform_tree.hpp"
#include "pocd/recording/cdr.hpp"

namespace pocd::recording {

inline void put_header(CdrWriter& out, StampNs stamp_ns, const std::string& frame) {
  out.number(static_cast<std::int32_t>(stamp_ns / 1'000'000'000));
  out.number(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
  out.string(frame);
}

inline void put_pose(CdrWriter& out, const PoseQuaternion& T) {
  for (int i = 0; i < 3; ++i) out.number(T.position[i]);
  for (int i = 0; i < 4; ++i) out.number(T.rotation.coeffs()[i]);
}

inline Bytes image_payload(StampNs stamp_ns, const std::string& frame, const std::string& encoding,
                           const cv::Mat& image) {
  CdrWriter out;
  put_header(out, stamp_ns, frame);
  out.number(static_cast<std::uint32_t>(image.rows));
  out.number(static_cast<std::uint32_t>(image.cols));
  out.string(encoding);
  out.number(std::uint8_t{0});
  const std::size_t step = image.cols * image.elemSize();
  out.number(static_cast<std::uint32_t>(step));
  out.number(static_cast<std::uint32_t>(step * image.rows));
  for (int row = 0; row < image.rows; ++row) out.raw(image.ptr(row), step);
  return out.bytes();
}

/// As image_transport's compressedDepth: 12 bytes of header, then PNG.
inline Bytes compressed_depth_payload(StampNs stamp_ns, const std::string& frame,
                                      const cv::Mat& depth) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", depth, png);
  std::vector<std::uint8_t> data(12 + png.size(), 0);
  std::copy(png.begin(), png.end(), data.begin() + 12);
  CdrWriter out;
  put_header(out, stamp_ns, frame);
  out.string("16UC1; compressedDepth");
  out.number(static_cast<std::uint32_t>(data.size()));
  out.raw(data.data(), data.size());
  return out.bytes();
}

inline Bytes camera_info_payload(StampNs stamp_ns, const std::string& frame,
                                 const CameraModel& camera) {
  CdrWriter out;
  put_header(out, stamp_ns, frame);
  out.number(static_cast<std::uint32_t>(camera.height));
  out.number(static_cast<std::uint32_t>(camera.width));
  out.string("plumb_bob");
  out.number(std::uint32_t{0});
  for (const double k : {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0}) {
    out.number(k);
  }
  for (int i = 0; i < 9 + 12; ++i) out.number(0.0);
  for (int i = 0; i < 6; ++i) out.number(std::uint32_t{0});
  out.number(std::uint8_t{0});
  return out.bytes();
}

inline Bytes odometry_payload(StampNs stamp_ns, const std::string& parent, const std::string& child,
                              const PoseQuaternion& T) {
  CdrWriter out;
  put_header(out, stamp_ns, parent);
  out.string(child);
  put_pose(out, T);
  for (int i = 0; i < 36 + 6 + 36; ++i) out.number(0.0);
  return out.bytes();
}

inline Bytes tf_payload(const std::vector<StampedTransform>& transforms) {
  CdrWriter out;
  out.number(static_cast<std::uint32_t>(transforms.size()));
  for (const auto& [parent, child, stamp_ns, T] : transforms) {
    put_header(out, stamp_ns, parent);
    out.string(child);
    put_pose(out, T);
  }
  return out.bytes();
}

inline Bytes tf_payload(StampNs stamp_ns, const std::string& parent, const std::string& child,
                        const PoseQuaternion& T) {
  return tf_payload({{parent, child, stamp_ns, T}});
}

}  // namespace pocd::recording

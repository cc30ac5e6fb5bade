// The ROS 2 messages that frames are made of, decoded from CDR.
#pragma once

#include <string>
#include <vector>

#include "pocd/common/types.hpp"
#include "pocd/input/message_checks.hpp"
#include "pocd/input/pose_quaternion.hpp"
#include "pocd/recording/cdr.hpp"

namespace pocd::recording {

struct RosHeader {
  StampNs stamp_ns = 0;
  std::string frame_id;
};

/// sensor_msgs/Image or, with `compressed`, CompressedImage: its format is the encoding. `data` is
/// a view into the payload.
struct RosImage {
  RosHeader header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
  bool compressed = false;
};

struct RosCameraInfo {
  RosHeader header;
  CameraInfoFields fields;
};

/// One transform T_parent_child; parent is header.frame_id. Values as they came, not checked.
struct RosTransform {
  RosHeader header;
  std::string child_frame_id;
  PoseQuaternion T;
};

/// For the checks; valid as long as `image` and its payload.
ImageView view_of(const RosImage& image);

/// All throw DamagedData when the payload does not fit the type.
RosImage decode_image(const std::uint8_t* data, std::size_t size);
RosImage decode_compressed_image(const std::uint8_t* data, std::size_t size);
RosCameraInfo decode_camera_info(const std::uint8_t* data, std::size_t size);
RosTransform decode_odometry(const std::uint8_t* data, std::size_t size);
std::vector<RosTransform> decode_tf(const std::uint8_t* data, std::size_t size);

}  // namespace pocd::recording

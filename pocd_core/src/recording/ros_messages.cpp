#include "pocd/recording/ros_messages.hpp"

namespace pocd::recording {
namespace {

RosHeader read_header(CdrReader& in) {
  RosHeader header;
  const auto seconds = in.number<std::int32_t>();
  const auto nanoseconds = in.number<std::uint32_t>();
  header.stamp_ns = StampNs{seconds} * 1'000'000'000 + nanoseconds;
  header.frame_id = in.string();
  return header;
}

PoseQuaternion read_pose(CdrReader& in) {
  PoseQuaternion pose;
  for (int i = 0; i < 3; ++i) pose.position[i] = in.number<double>();
  for (int i = 0; i < 4; ++i) pose.rotation.coeffs()[i] = in.number<double>();  // x, y, z, w
  return pose;
}

}  // namespace

ImageView view_of(const RosImage& image) {
  return {image.width, image.height, image.encoding, image.is_bigendian != 0,
          image.step,  image.data,   image.size,     image.compressed};
}

RosImage decode_image(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  RosImage image;
  image.header = read_header(in);
  image.height = in.number<std::uint32_t>();
  image.width = in.number<std::uint32_t>();
  image.encoding = in.string();
  image.is_bigendian = in.number<std::uint8_t>();
  image.step = in.number<std::uint32_t>();
  image.size = in.length(1);
  image.data = in.bytes(image.size);
  return image;
}

RosImage decode_compressed_image(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  RosImage image;
  image.compressed = true;
  image.header = read_header(in);
  image.encoding = in.string();
  image.size = in.length(1);
  image.data = in.bytes(image.size);
  return image;
}

RosCameraInfo decode_camera_info(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  RosCameraInfo info;
  info.header = read_header(in);
  CameraInfoFields& fields = info.fields;
  fields.height = in.number<std::uint32_t>();
  fields.width = in.number<std::uint32_t>();
  in.string();  // distortion model
  for (std::size_t left = in.length(sizeof(double)); left > 0; --left) {
    fields.distorted = in.number<double>() != 0.0 || fields.distorted;
  }
  for (double& value : fields.k) value = in.number<double>();
  for (int i = 0; i < 9; ++i) in.number<double>();  // r
  for (double& value : fields.p) value = in.number<double>();
  fields.binning_x = in.number<std::uint32_t>();
  fields.binning_y = in.number<std::uint32_t>();
  fields.roi_x = in.number<std::uint32_t>();
  fields.roi_y = in.number<std::uint32_t>();
  fields.roi_height = in.number<std::uint32_t>();
  fields.roi_width = in.number<std::uint32_t>();
  in.boolean();
  return info;
}

RosTransform decode_odometry(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  RosTransform odometry;
  odometry.header = read_header(in);
  odometry.child_frame_id = in.string();
  odometry.T = read_pose(in);
  for (int i = 0; i < 36 + 6 + 36; ++i) in.number<double>();  // covariance, twist, covariance
  return odometry;
}

std::vector<RosTransform> decode_tf(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  // Stamp, two empty names and seven numbers.
  std::vector<RosTransform> transforms(in.length(8 + 2 * 4 + 7 * 8));
  for (RosTransform& transform : transforms) {
    transform.header = read_header(in);
    transform.child_frame_id = in.string();
    transform.T = read_pose(in);
  }
  return transforms;
}

}  // namespace pocd::recording

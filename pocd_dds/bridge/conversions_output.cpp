#include <algorithm>

#include "pocd/common/check.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/geometry_messages.hpp"

namespace pocd::dds {

std_msgs::msg::Header header_of(StampNs stamp_ns, const std::string& frame_id) {
  std_msgs::msg::Header header;
  header.stamp(to_time(stamp_ns));
  header.frame_id(frame_id);
  return header;
}

geometry_msgs::msg::Point point_of(const Eigen::Vector3d& p) {
  geometry_msgs::msg::Point point;
  point.x(p.x()), point.y(p.y()), point.z(p.z());
  return point;
}

geometry_msgs::msg::Quaternion quaternion_of(const Eigen::Quaterniond& q) {
  geometry_msgs::msg::Quaternion quaternion;
  quaternion.x(q.x()), quaternion.y(q.y()), quaternion.z(q.z()), quaternion.w(q.w());
  return quaternion;
}

geometry_msgs::msg::Vector3 vector_of(const Eigen::Vector3d& v) {
  geometry_msgs::msg::Vector3 vector;
  vector.x(v.x()), vector.y(v.y()), vector.z(v.z());
  return vector;
}

sensor_msgs::msg::Image image_message(const cv::Mat& image, const std::string& encoding,
                                      StampNs stamp_ns, const std::string& frame_id) {
  POCD_CHECK(!image.empty());
  sensor_msgs::msg::Image message;
  message.header(header_of(stamp_ns, frame_id));
  message.height(static_cast<std::uint32_t>(image.rows));
  message.width(static_cast<std::uint32_t>(image.cols));
  message.encoding(encoding);
  const std::size_t row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
  message.step(static_cast<std::uint32_t>(row_bytes));
  message.data().resize(row_bytes * static_cast<std::size_t>(image.rows));
  for (int row = 0; row < image.rows; ++row) {
    std::copy_n(image.ptr<std::uint8_t>(row), row_bytes, message.data().data() + row * row_bytes);
  }
  return message;
}

sensor_msgs::msg::CameraInfo camera_message(const CameraModel& camera, StampNs stamp_ns,
                                            const std::string& frame_id) {
  sensor_msgs::msg::CameraInfo message;
  message.header(header_of(stamp_ns, frame_id));
  message.height(static_cast<std::uint32_t>(camera.height));
  message.width(static_cast<std::uint32_t>(camera.width));
  message.distortion_model("plumb_bob");
  message.d(std::vector<double>(5, 0.0));
  message.k({camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1});
  message.r({1, 0, 0, 0, 1, 0, 0, 0, 1});
  message.p({camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0});
  return message;
}

nav_msgs::msg::Odometry odometry_message(const StampedTransform& transform) {
  nav_msgs::msg::Odometry message;
  message.header(header_of(transform.stamp_ns, transform.parent));
  message.child_frame_id(transform.child);
  message.pose().pose().position(point_of(transform.T.position));
  message.pose().pose().orientation(quaternion_of(transform.T.rotation));
  return message;
}

geometry_msgs::msg::TransformStamped transform_message(const StampedTransform& transform) {
  geometry_msgs::msg::TransformStamped message;
  message.header(header_of(transform.stamp_ns, transform.parent));
  message.child_frame_id(transform.child);
  message.transform().translation(vector_of(transform.T.position));
  message.transform().rotation(quaternion_of(transform.T.rotation));
  return message;
}

}  // namespace pocd::dds

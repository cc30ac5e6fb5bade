#include "pocd_dds/bridge/conversions.hpp"

#include <algorithm>

namespace pocd::dds {
namespace {

StampedTransform transform_of(const std_msgs::msg::Header& header, const std::string& child) {
  StampedTransform transform;
  transform.parent = header.frame_id();
  transform.child = child;
  transform.stamp_ns = to_stamp(header.stamp());
  return transform;
}

}  // namespace

StampNs to_stamp(const builtin_interfaces::msg::Time& time) {
  return StampNs{time.sec()} * 1'000'000'000 + time.nanosec();
}

builtin_interfaces::msg::Time to_time(StampNs stamp_ns) {
  constexpr StampNs kSecond = 1'000'000'000;
  StampNs seconds = stamp_ns / kSecond, rest = stamp_ns % kSecond;
  if (rest < 0) {
    --seconds;
    rest += kSecond;
  }
  builtin_interfaces::msg::Time time;
  time.sec(static_cast<std::int32_t>(seconds));
  time.nanosec(static_cast<std::uint32_t>(rest));
  return time;
}

Checked<CameraModel> camera_from(const sensor_msgs::msg::CameraInfo& info) {
  CameraInfoFields fields;
  fields.width = info.width();
  fields.height = info.height();
  fields.k = info.k();
  fields.p = info.p();
  fields.distorted =
      std::any_of(info.d().begin(), info.d().end(), [](double value) { return value != 0.0; });
  fields.binning_x = info.binning_x();
  fields.binning_y = info.binning_y();
  fields.roi_x = info.roi().x_offset();
  fields.roi_y = info.roi().y_offset();
  fields.roi_width = info.roi().width();
  fields.roi_height = info.roi().height();
  return camera_model(fields);
}

Checked<StampedTransform> transform_from(const nav_msgs::msg::Odometry& odometry) {
  StampedTransform transform = transform_of(odometry.header(), odometry.child_frame_id());
  const auto& pose = odometry.pose().pose();
  transform.T.position = {pose.position().x(), pose.position().y(), pose.position().z()};
  transform.T.rotation = Eigen::Quaterniond(pose.orientation().w(), pose.orientation().x(),
                                            pose.orientation().y(), pose.orientation().z());
  return checked_transform(std::move(transform));
}

Checked<StampedTransform> transform_from(const geometry_msgs::msg::TransformStamped& message) {
  StampedTransform transform = transform_of(message.header(), message.child_frame_id());
  const auto& T = message.transform();
  transform.T.position = {T.translation().x(), T.translation().y(), T.translation().z()};
  transform.T.rotation =
      Eigen::Quaterniond(T.rotation().w(), T.rotation().x(), T.rotation().y(), T.rotation().z());
  return checked_transform(std::move(transform));
}

}  // namespace pocd::dds

// A robot with a small camera, played by the test itself.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bus_harness.hpp"
#include "nav_msgsPubSubTypes.h"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "sensor_msgsPubSubTypes.h"
#include "tf2_msgsPubSubTypes.h"

namespace pocd {

/// Reliable and long enough that what a test counts does not depend on luck.
inline constexpr dds::Delivery kTestDelivery{true, false, 200, 0, 0, false, 0};

class RobotSender {
 public:
  RobotSender(const std::shared_ptr<dds::Participant>& bus, const std::string& name,
              bool with_labels = false)
      : name_(name),
        info_(bus, dds::topics::kCameraInfo, "rt/" + name + "/depth/camera_info", kTestDelivery),
        odometry_(bus, dds::topics::kOdometry, "rt/" + name + "/odom", kTestDelivery),
        depth_(bus, dds::topics::kDepth, "rt/" + name + "/depth/image_raw", kTestDelivery) {
    if (with_labels) {
      labels_ = std::make_unique<dds::Writer<sensor_msgs::msg::ImagePubSubType>>(
          bus, dds::topics::kSegmentation, "rt/" + name + "/segmentation", kTestDelivery);
    }
  }

  bool matched() const {
    return depth_.matched() > 0 && info_.matched() > 0 && odometry_.matched() > 0 &&
           (!labels_ || labels_->matched() > 0);
  }
  std::string camera_frame() const { return name_ + "_camera"; }
  std::string depth_topic() const { return "rt/" + name_ + "/depth/image_raw"; }

  /// Camera info and a wall 1.5 m away.
  void send_image(StampNs stamp_ns, const std::string& frame = "") {
    const std::string camera = frame.empty() ? camera_frame() : frame;
    auto info = dds::camera_message({30, 20, 40 * zoom_, 40 * zoom_, 15, 10}, stamp_ns, camera);
    EXPECT_TRUE(info_.write(info));
    auto depth =
        dds::image_message(cv::Mat(20, 30, CV_16UC1, cv::Scalar(1500)), "16UC1", stamp_ns, camera);
    EXPECT_TRUE(depth_.write(depth));
  }
  void zoom(double factor) { zoom_ *= factor; }
  void send_labels(StampNs stamp_ns) {
    auto labels =
        dds::image_message(cv::Mat(20, 30, CV_8UC1, cv::Scalar(0)), "mono8", stamp_ns, "");
    EXPECT_TRUE(labels_->write(labels));
  }
  void send_odometry(const StampedTransform& transform) {
    auto message = dds::odometry_message(transform);
    EXPECT_TRUE(odometry_.write(message));
  }
  /// A whole frame of a robot that stands at the origin, its camera being its base.
  void send_frame(StampNs stamp_ns) {
    send_odometry({"map", camera_frame(), stamp_ns, {}});
    if (labels_) send_labels(stamp_ns);
    send_image(stamp_ns);
  }

 private:
  std::string name_;
  double zoom_ = 1.0;
  dds::Writer<sensor_msgs::msg::CameraInfoPubSubType> info_;
  dds::Writer<nav_msgs::msg::OdometryPubSubType> odometry_;
  std::unique_ptr<dds::Writer<sensor_msgs::msg::ImagePubSubType>> labels_;
  dds::Writer<sensor_msgs::msg::ImagePubSubType> depth_;  // last: whoever knows it knows the others
};

/// A writer of rt/tf or rt/tf_static.
class TransformSender {
 public:
  TransformSender(const std::shared_ptr<dds::Participant>& bus, const dds::TopicSpec& spec)
      : writer_(bus, spec, spec.name,
                spec.delivery.transient_local ? spec.delivery : kTestDelivery) {}

  bool matched() const { return writer_.matched() > 0; }
  void send(const std::vector<StampedTransform>& transforms) {
    tf2_msgs::msg::TFMessage message;
    for (const StampedTransform& transform : transforms) {
      message.transforms().push_back(dds::transform_message(transform));
    }
    EXPECT_TRUE(writer_.write(message));
  }

 private:
  dds::Writer<tf2_msgs::msg::TFMessagePubSubType> writer_;
};

/// Counts the frames that a node says it has processed, by robot.
class FrameWatch {
 public:
  explicit FrameWatch(const std::shared_ptr<dds::Participant>& bus)
      : reader_(bus, dds::topics::kFrames, wakeup_) {}

  bool matched() const { return reader_.matched() > 0; }
  int processed(const std::string& robot) {
    pocd_msgs::msg::FrameRecord record;
    dds::SampleMeta meta;
    while (reader_.take(record, meta)) {
      if (meta.valid && record.outcome() == 0) ++processed_[record.robot()];
    }
    return processed_[robot];
  }

 private:
  dds::Wakeup wakeup_;
  dds::Reader<pocd_msgs::msg::FrameRecordPubSubType> reader_;
  std::map<std::string, int> processed_;
};

/// pocd_node that listens to whoever appears.
inline std::vector<std::string> fleet_command(const TestDomain& domain,
                                              const std::vector<std::string>& more = {}) {
  std::vector<std::string> command{bin("pocd_node"), "--config", source("config/simulated.yaml"),
                                   "--domain", domain.text()};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

}  // namespace pocd

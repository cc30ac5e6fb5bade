// A robot with a small camera, played by the test itself.
#pragma once

#include <algorithm>
#include <map>
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
        info(bus, dds::topics::kCameraInfo, "rt/" + name + "/depth/camera_info", kTestDelivery),
        odometry(bus, dds::topics::kOdometry, "rt/" + name + "/odom", kTestDelivery),
        depth(bus, dds::topics::kDepth, "rt/" + name + "/depth/image_raw", kTestDelivery) {
    if (with_labels) {
      labels = std::make_unique<dds::Writer<sensor_msgs::msg::ImagePubSubType>>(
          bus, dds::topics::kSegmentation, "rt/" + name + "/segmentation", kTestDelivery);
    }
  }

  bool matched() const {
    return depth.matched() > 0 && info.matched() > 0 && odometry.matched() > 0 &&
           (!labels || labels->matched() > 0);
  }
  std::string camera_frame() const { return name_ + "_camera"; }
  std::string depth_topic() const { return "rt/" + name_ + "/depth/image_raw"; }

  /// A wall 1.5 m away.
  sensor_msgs::msg::Image image(StampNs stamp_ns, const std::string& frame = "") const {
    return dds::image_message(cv::Mat(20, 30, CV_16UC1, cv::Scalar(1500)), "16UC1", stamp_ns,
                              frame.empty() ? camera_frame() : frame);
  }
  /// With its camera info.
  void send_image(StampNs stamp_ns, const std::string& frame = "") {
    auto camera = dds::camera_message({30, 20, 40 * zoom_, 40 * zoom_, 15, 10}, stamp_ns,
                                      frame.empty() ? camera_frame() : frame);
    EXPECT_TRUE(info.write(camera));
    auto wall = image(stamp_ns, frame);
    EXPECT_TRUE(depth.write(wall));
  }
  void zoom(double factor) { zoom_ *= factor; }
  void send_labels(StampNs stamp_ns) {
    auto unlabelled =
        dds::image_message(cv::Mat(20, 30, CV_8UC1, cv::Scalar(0)), "mono8", stamp_ns, "");
    EXPECT_TRUE(labels->write(unlabelled));
  }
  void send_odometry(const StampedTransform& transform) {
    auto message = dds::odometry_message(transform);
    EXPECT_TRUE(odometry.write(message));
  }
  /// A whole frame of a robot that stands at the origin, its camera being its base.
  void send_frame(StampNs stamp_ns) {
    send_odometry({"map", camera_frame(), stamp_ns, {}});
    if (labels) send_labels(stamp_ns);
    send_image(stamp_ns);
  }

 private:
  std::string name_;
  double zoom_ = 1.0;

 public:
  // For messages that no camera sends.
  dds::Writer<sensor_msgs::msg::CameraInfoPubSubType> info;
  dds::Writer<nav_msgs::msg::OdometryPubSubType> odometry;
  std::unique_ptr<dds::Writer<sensor_msgs::msg::ImagePubSubType>> labels;  ///< null without
  dds::Writer<sensor_msgs::msg::ImagePubSubType> depth;  // last: whoever knows it knows the others
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
      : reader_(bus, dds::topics::kFrames, wakeup_), behind_(bus) {}

  /// From here on every record is heard. That the reader has found the node's writer does not say
  /// that the writer has found the reader, and records are not kept for late joiners. But a
  /// participant announces its readers in the order of their making: a node whose health has come
  /// in by a reader that was made later has found this one, too.
  bool matched() { return reader_.matched() > 0 && behind_.newest() != nullptr; }
  /// Those with this stamp or a later one.
  int processed(const std::string& robot, StampNs from_ns = 0) {
    pocd_msgs::msg::FrameRecord record;
    dds::SampleMeta meta;
    while (reader_.take(record, meta)) {
      if (meta.valid && record.outcome() == 0) {
        processed_[record.robot()].push_back(dds::to_stamp(record.stamp()));
      }
    }
    const std::vector<StampNs>& stamps = processed_[robot];
    return static_cast<int>(std::count_if(stamps.begin(), stamps.end(),
                                          [&](StampNs stamp_ns) { return stamp_ns >= from_ns; }));
  }

 private:
  dds::Wakeup wakeup_;
  dds::Reader<pocd_msgs::msg::FrameRecordPubSubType> reader_;
  HealthWatch behind_;  // made after the reader
  std::map<std::string, std::vector<StampNs>> processed_;
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

// A recording of two robots for tests.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pocd/datasets/readers.hpp"
#include "recordings.hpp"
#include "ros_payloads.hpp"

namespace pocd::recording {

inline constexpr StampNs kPeriod = 100'000'000;
inline const CameraModel kCamera{8, 6, 5, 5, 3.5, 2.5};

inline PoseQuaternion pose_at(const std::string& robot, StampNs stamp_ns) {
  PoseQuaternion T;
  T.position = {static_cast<double>(stamp_ns) * 1e-9, robot == "a" ? 1.0 : 2.0, 0.0};
  return T;
}

/// Two robots with 10 Hz cameras, half a period apart. Odometry comes a little after the images
/// that it belongs to, so frames have to wait for it.
class RecordedRun {
 public:
  explicit RecordedRun(const std::filesystem::path& file, const McapWriterOptions& options = {})
      : writer_(file, options) {
    for (const std::string robot : {"a", "b"}) {
      add_channel("/" + robot + "/depth/image_raw", "sensor_msgs/msg/Image");
      add_channel("/" + robot + "/segmentation", "sensor_msgs/msg/Image");
      add_channel("/" + robot + "/depth/camera_info", "sensor_msgs/msg/CameraInfo");
      add_channel("/" + robot + "/odom", "nav_msgs/msg/Odometry");
    }
    add_channel("/tf_static", "tf2_msgs/msg/TFMessage");
    add_channel("pocd/frames", "pocd_msgs/msg/FrameRecord");
  }

  void write(const std::string& topic, StampNs log_ns, const Bytes& payload) {
    writer_.write({channels_.at(topic), 0, static_cast<std::uint64_t>(log_ns), 0}, payload.data(),
                  payload.size());
  }
  void write_mounts(StampNs log_ns) {
    PoseQuaternion mount;
    mount.position = {0, 0, 0.5};
    for (const std::string robot : {"a", "b"}) {
      write("/tf_static", log_ns, tf_payload(0, robot + "/base", robot + "/camera", mount));
    }
  }
  void write_frame(const std::string& robot, StampNs stamp_ns, bool with_labels = true) {
    const cv::Mat depth(6, 8, CV_16UC1, cv::Scalar(1500));
    const cv::Mat labels(6, 8, CV_8UC1, cv::Scalar(7));
    const std::string camera = robot + "/camera";
    write("/" + robot + "/depth/image_raw", stamp_ns,
          image_payload(stamp_ns, camera, "16UC1", depth));
    write("/" + robot + "/depth/camera_info", stamp_ns + 10,
          camera_info_payload(stamp_ns, camera, kCamera));
    if (with_labels) {
      write("/" + robot + "/segmentation", stamp_ns + 30'000'000,
            image_payload(stamp_ns, camera, "mono8", labels));
    }
    write("/" + robot + "/odom", stamp_ns + 40'000'000,
          odometry_payload(stamp_ns, "map", robot + "/base", pose_at(robot, stamp_ns)));
  }
  void write_record(const std::string& robot, StampNs stamp_ns, std::uint64_t order, bool labels) {
    CdrWriter out;
    out.number(static_cast<std::int32_t>(stamp_ns / 1'000'000'000));
    out.number(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
    out.string(robot);
    out.number(std::uint64_t{5});
    out.number(order);
    out.number(std::uint8_t{order == 0});
    out.number(std::uint8_t{labels});
    out.number(std::uint8_t{0});
    write("pocd/frames", stamp_ns + 50'000'000, out.bytes());
  }
  McapWriter& writer() { return writer_; }
  void add_channel(const std::string& topic, const std::string& type) {
    channels_[topic] =
        writer_.add_channel(writer_.add_schema(type, "ros2msg", ""), topic, "cdr", {});
  }

 private:
  McapWriter writer_;
  std::map<std::string, std::uint16_t> channels_;
};

inline std::vector<Frame> frames_of(DatasetReader& reader) {
  std::vector<Frame> frames;
  while (auto frame = reader.next()) frames.push_back(std::move(*frame));
  return frames;
}

inline DatasetOptions options_for(std::vector<std::filesystem::path> inputs) {
  DatasetOptions options;
  options.format = DatasetFormat::kMcap;
  options.inputs = std::move(inputs);
  return options;
}

}  // namespace pocd::recording

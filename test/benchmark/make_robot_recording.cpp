// Writes what simulated robots with cameras of 640 x 480 send, colour, depth and segmentation, for
// bus_latency.sh: usage make_robot_recording SCENARIO FILE ROBOTS RATE_HZ SECONDS. Made before, so
// that rendering takes nothing from the machine while the component is measured.
#include <cstdlib>
#include <iostream>
#include <map>
#include <opencv2/imgproc.hpp>

#include "pocd/common/check.hpp"
#include "pocd/recording/mcap_writer.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"
#include "ros_payloads.hpp"

namespace {

using namespace pocd;             // NOLINT
using namespace pocd::recording;  // NOLINT

constexpr const char* kVolatile =
    "reliability: true\ndurability: false\nownership: false\nkeyed: false";
constexpr const char* kLatched =
    "reliability: true\ndurability: true\nownership: false\nkeyed: false";

class RobotRecording {
 public:
  explicit RobotRecording(const std::string& file) : writer_(file, uncompressed()) {}

  void put(const std::string& topic, const std::string& type, StampNs stamp_ns,
           const Bytes& payload) {
    auto known = channels_.find(topic);
    if (known == channels_.end()) {
      auto schema = schemas_.find(type);
      if (schema == schemas_.end()) {
        schema = schemas_.emplace(type, writer_.add_schema(type, "", "")).first;
      }
      const char* qos = topic == "/tf_static" ? kLatched : kVolatile;
      known = channels_
                  .emplace(topic, writer_.add_channel(schema->second, topic, "cdr", {{"qos", qos}}))
                  .first;
    }
    const auto time_ns = static_cast<std::uint64_t>(stamp_ns);
    writer_.write({known->second, sequence_++, time_ns, time_ns}, payload.data(), payload.size());
  }
  void close() { writer_.close(); }

 private:
  static McapWriterOptions uncompressed() {
    McapWriterOptions options;
    options.compression = ChunkCompression::kNone;
    return options;
  }

  McapWriter writer_;
  std::map<std::string, std::uint16_t> schemas_;
  std::map<std::string, std::uint16_t> channels_;
  std::uint32_t sequence_ = 0;
};

void put_frame(const Frame& frame, const Pose& T_B_C, RobotRecording& out) {
  const std::string robot = "/" + frame.robot, base = frame.robot + "/base_link";
  const std::string camera = frame.robot + "/camera";
  const StampNs stamp = frame.stamp_ns;
  cv::Mat millimetres, rgb;
  frame.depth_m.convertTo(millimetres, CV_16U, 1000.0);
  cv::cvtColor(frame.color, rgb, cv::COLOR_BGR2RGB);
  cv::Mat labels;
  frame.labels.convertTo(labels, CV_8U);
  const PoseQuaternion T_W_B = to_quaternion(frame.T_W_C * T_B_C.inverse());
  out.put(robot + "/odom", "nav_msgs/msg/Odometry", stamp,
          odometry_payload(stamp, "map", base, T_W_B));
  out.put(robot + "/depth/camera_info", "sensor_msgs/msg/CameraInfo", stamp,
          camera_info_payload(stamp, camera, frame.camera));
  out.put(robot + "/color/image_raw", "sensor_msgs/msg/Image", stamp,
          image_payload(stamp, camera, "rgb8", rgb));
  out.put(robot + "/segmentation", "sensor_msgs/msg/Image", stamp,
          image_payload(stamp, camera, "mono8", labels));
  out.put(robot + "/depth/image_raw", "sensor_msgs/msg/Image", stamp,
          image_payload(stamp, camera, "16UC1", millimetres));
}

int write_recording(char** argv) {
  Scenario scenario = load_scenario(argv[1]);
  const auto robots = static_cast<std::size_t>(std::atoi(argv[3]));
  scenario.frame_rate_hz = std::atof(argv[4]);
  const double seconds = std::atof(argv[5]);
  if (robots < 1 || robots > scenario.robots.size() || !(scenario.frame_rate_hz > 0.0)) {
    throw InputError("robots or rate out of range for " + std::string(argv[1]));
  }
  scenario.robots.resize(robots);
  scenario.camera = {640, 480, 430.0, 430.0, 319.5, 239.5};
  SimReaderOptions options;
  options.threads = 2;
  SimReader reader(scenario, options);
  RobotRecording out(argv[2]);
  bool first = true;
  StampNs begin_ns = 0;
  while (const auto frame = reader.next()) {
    if (first) {
      begin_ns = frame->stamp_ns;
      first = false;
      for (const SimRobot& robot : scenario.robots) {
        out.put("/tf_static", "tf2_msgs/msg/TFMessage", begin_ns,
                tf_payload(begin_ns, robot.name + "/base_link", robot.name + "/camera",
                           to_quaternion(scenario.extrinsics.T_B_C)));
      }
    }
    if (static_cast<double>(frame->stamp_ns - begin_ns) > 1e9 * seconds) break;
    put_frame(*frame, scenario.extrinsics.T_B_C, out);
  }
  out.close();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "usage: make_robot_recording SCENARIO FILE ROBOTS RATE_HZ SECONDS\n";
    return 2;
  }
  try {
    return write_recording(argv);
  } catch (const InputError& error) {
    std::cerr << "make_robot_recording: " << error.what() << "\n";
    return 1;
  }
}

// Where frames come from: robots, topics, and how their streams are put together. The same on the
// bus and in recordings.
#pragma once

#include <string>
#include <vector>

#include "pocd/common/describe.hpp"

namespace pocd {

/// Names of the input topics as they are on the bus; {robot} is the robot's name.
namespace input_names {
inline constexpr char kDepth[] = "rt/{robot}/depth/image_raw";
inline constexpr char kCameraInfo[] = "rt/{robot}/depth/camera_info";
inline constexpr char kSegmentation[] = "rt/{robot}/segmentation";
inline constexpr char kColor[] = "rt/{robot}/color/image_raw";
inline constexpr char kOdometry[] = "rt/{robot}/odom";
inline constexpr char kTf[] = "rt/tf";
inline constexpr char kTfStatic[] = "rt/tf_static";
}  // namespace input_names

/// What is done with a stream of images.
enum class StreamUse {
  kAbsent,    ///< not looked at
  kOptional,  ///< waited for, then gone on without
  kRequired,  ///< waited for, then the frame is dropped
};
inline EnumWords<StreamUse> words_of(StreamUse) {
  return {{StreamUse::kAbsent, "absent"},
          {StreamUse::kOptional, "optional"},
          {StreamUse::kRequired, "required"}};
}

/// Where the camera sits when no tf_static says so.
struct MountConfig {
  bool given = false;
  std::string base_frame = "base_link";
  double x_m = 0.0, y_m = 0.0, z_m = 0.0;
  double qx = 0.0, qy = 0.0, qz = 0.0, qw = 1.0;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("given", given, "Use this mount; otherwise it has to come on tf_static.");
    visit("base_frame", base_frame, "Frame that the camera is mounted on.");
    visit("x_m", x_m, Range{-100, 100}, "Position of the camera in the base frame [m].");
    visit("y_m", y_m, Range{-100, 100}, "Position of the camera in the base frame [m].");
    visit("z_m", z_m, Range{-100, 100}, "Position of the camera in the base frame [m].");
    visit("qx", qx, Range{-1, 1}, "Rotation of the camera in the base frame, unit quaternion.");
    visit("qy", qy, Range{-1, 1}, "Rotation of the camera in the base frame, unit quaternion.");
    visit("qz", qz, Range{-1, 1}, "Rotation of the camera in the base frame, unit quaternion.");
    visit("qw", qw, Range{-1, 1}, "Rotation of the camera in the base frame, unit quaternion.");
  }
  std::vector<std::string> inconsistencies() const;
};

/// One robot with one camera. An empty topic means the pattern of TopicPatterns. A robot with
/// several cameras has an entry for each.
struct RobotConfig {
  std::string name;
  std::string depth_topic, camera_info_topic, segmentation_topic, color_topic, odometry_topic;
  std::string tf_topic, tf_static_topic;
  std::string camera_frame;
  double depth_scale = 0.0;
  MountConfig mount;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("name", name, "Name of the robot: takes the place of {robot} in topic patterns.");
    visit("depth_topic", depth_topic, "Topic of the depth images; empty: by the pattern.");
    visit("camera_info_topic", camera_info_topic,
          "Topic of the camera info; empty: by the pattern.");
    visit("segmentation_topic", segmentation_topic,
          "Topic of the segmentation images; empty: by the pattern.");
    visit("color_topic", color_topic, "Topic of the colour images; empty: by the pattern.");
    visit("odometry_topic", odometry_topic, "Topic of the odometry; empty: by the pattern.");
    visit("tf_topic", tf_topic, "Topic of the robot's own transforms; empty: by the pattern.");
    visit("tf_static_topic", tf_static_topic,
          "Topic of its static transforms; must be given where tf_topic is, and only there.");
    visit("camera_frame", camera_frame,
          "Optical frame of the depth camera; empty: what the depth images name.");
    visit("depth_scale", depth_scale, Range{0.0, 1000.0},
          "Factor on this robot's depth values; 0: node.depth_scale.");
    visit.group("mount", mount, "Where the camera is mounted.");
  }
};

struct TopicPatterns {
  std::string depth = input_names::kDepth;
  std::string camera_info = input_names::kCameraInfo;
  std::string segmentation = input_names::kSegmentation;
  std::string color = input_names::kColor;
  std::string odometry = input_names::kOdometry;
  std::string tf = input_names::kTf;
  std::string tf_static = input_names::kTfStatic;

  /// The patterns that name a topic of one robot.
  std::vector<std::string> of_each_robot() const {
    return {depth, camera_info, segmentation, color, odometry};
  }
  /// Every robot has topics of its own for its transforms.
  bool own_tf() const { return tf.find("{robot}") != std::string::npos; }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("depth", depth, "Depth images: 16UC1 [mm], 32FC1 [m], or compressedDepth.");
    visit("camera_info", camera_info, "Intrinsics of the depth images.");
    visit("segmentation", segmentation, "Class images, registered to depth.");
    visit("color", color, "Colour images, registered to depth.");
    visit("odometry", odometry, "Poses of the robot.");
    visit("tf", tf, "Transforms that change; without {robot}, all robots share the topic.");
    visit("tf_static", tf_static, "Transforms that do not; with {robot} where tf has it.");
  }
};

/// Everything that says how messages become frames. A part of the group `node`.
struct InputConfig {
  std::vector<RobotConfig> robots;
  bool discover_robots = false;
  TopicPatterns topics;
  StreamUse segmentation = StreamUse::kOptional;
  StreamUse color = StreamUse::kAbsent;
  std::string map_frame = "map";
  double sync_wait_s = 0.3;
  double stamp_tolerance_s = 0.01;
  double extrapolation_s = 0.0;
  double max_pose_gap_s = 0.5;
  double merge_wait_s = 1.0;
  double max_frame_rate_hz = 0.0;
  double depth_scale = 1.0;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("robots", robots,
          "The robots whose cameras are listened to; none: all that appear on the bus.");
    visit("discover_robots", discover_robots,
          "Beside the named robots, listen to all others that appear on the bus.");
    visit.group("topics", topics,
                "Names of the input topics on the bus; {robot} is the name. A ROS name (/a) means "
                "rt/a. A topic that ends in /compressed or /compressedDepth is read as "
                "sensor_msgs/CompressedImage.");
    visit("segmentation", segmentation,
          "Segmentation images: not looked at, waited for and gone on without, or necessary.");
    visit("color", color, "The same for colour.");
    visit("map_frame", map_frame, "Frame of the map: root of the poses.");
    visit("sync_wait_s", sync_wait_s, Range{0.0, 60.0},
          "How far newer data may run ahead of an incomplete frame [s of data time].");
    visit("stamp_tolerance_s", stamp_tolerance_s, Range{0.0, 1.0},
          "Largest difference of stamps of images that belong together [s].");
    visit("extrapolation_s", extrapolation_s, Range{0.0, 1.0},
          "How long the newest pose is held when no later one comes [s].");
    visit("max_pose_gap_s", max_pose_gap_s, Range{0.001, 60.0},
          "Poses further apart than this are not interpolated between [s].");
    visit("merge_wait_s", merge_wait_s, Range{0.0, 60.0},
          "How far robots may run ahead of one that is late [s of data time].");
    visit("max_frame_rate_hz", max_frame_rate_hz, Range{0.0, 1000.0},
          "Depth images of a robot beyond this rate of their stamps are left out; 0: none [1/s].");
    visit(
        "depth_scale", depth_scale, Range{1e-6, 1000.0},
        "Factor on depth values: 1 for millimetres (16 bit) and metres (float), 0.1 for tenths of "
        "a millimetre, 0.001 for float millimetres.");
  }
  std::vector<std::string> inconsistencies() const;

  /// Makes `names` the robots; one that `robots` has keeps its entry. Without names, nothing
  /// changes. Throws InputError.
  void set_robots(const std::vector<std::string>& names);

  /// Masks come from a network that sees the colour images: those of the robots are not looked at.
  void use_color_alone() {
    segmentation = StreamUse::kAbsent;
    color = StreamUse::kRequired;
  }

  /// Robots are found by their topics.
  bool discovers() const { return robots.empty() || discover_robots; }
};

}  // namespace pocd

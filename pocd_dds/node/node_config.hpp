// Configuration of pocd_node: what the core needs, and where frames come from and results go to.
#pragma once

#include <string>
#include <vector>

#include "pocd/config/describe.hpp"
#include "pocd/memory/memory_config.hpp"
#include "pocd/pipeline/pipeline_config.hpp"
#include "pocd_dds/entities/topic_table.hpp"

namespace pocd::dds {

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

/// One robot with one camera. An empty topic means the pattern of TopicPatterns.
struct RobotConfig {
  std::string name;
  std::string depth_topic, camera_info_topic, segmentation_topic, color_topic, odometry_topic;
  std::string camera_frame;
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
    visit("camera_frame", camera_frame,
          "Optical frame of the depth camera; empty: what the depth images name.");
    visit.group("mount", mount, "Where the camera is mounted.");
  }
};

struct TopicPatterns {
  std::string depth = topics::kDepth.name;
  std::string camera_info = topics::kCameraInfo.name;
  std::string segmentation = topics::kSegmentation.name;
  std::string color = topics::kColor.name;
  std::string odometry = topics::kOdometry.name;
  std::string tf = topics::kTf.name;
  std::string tf_static = topics::kTfStatic.name;

  /// The patterns that name a topic of one robot.
  std::vector<std::string> of_each_robot() const {
    return {depth, camera_info, segmentation, color, odometry};
  }
  /// Every robot has topics of its own for its transforms.
  bool own_tf() const { return tf.find("{robot}") != std::string::npos; }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("depth", depth, "Depth images, 16UC1 [mm] or 32FC1 [m].");
    visit("camera_info", camera_info, "Intrinsics of the depth images.");
    visit("segmentation", segmentation, "Class images, registered to depth.");
    visit("color", color, "Colour images, registered to depth.");
    visit("odometry", odometry, "Poses of the robot.");
    visit("tf", tf, "Transforms that change; without {robot}, all robots share the topic.");
    visit("tf_static", tf_static, "Transforms that do not; with {robot} where tf has it.");
  }
};

/// Rates of the topics for others; 0 switches one off.
struct RosOutputConfig {
  double markers_hz = 1.0;
  double occupancy_hz = 1.0;
  double surface_hz = 0.5;
  double obstacles_hz = 1.0;
  double diagnostics_hz = 1.0;
  double occupancy_low_m = 0.1;
  double occupancy_high_m = 2.0;
  int surface_points = 2'000'000;
  double obstacle_lifetime_s = 3.0;
  std::string topic_namespace = "pocd";
  std::string level_name = "L1";

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("markers_hz", markers_hz, Range{0.0, 20.0}, "rt/pocd/objects/markers; 0: off [1/s].");
    visit("occupancy_hz", occupancy_hz, Range{0.0, 20.0},
          "rt/pocd/map and rt/pocd/map_updates, when the map has changed; 0: off [1/s].");
    visit("surface_hz", surface_hz, Range{0.0, 20.0},
          "rt/pocd/surface, while it has subscribers and when the map has changed; 0: off [1/s].");
    visit("obstacles_hz", obstacles_hz, Range{0.0, 20.0}, "rt/rmf_obstacles; 0: off [1/s].");
    visit("diagnostics_hz", diagnostics_hz, Range{0.0, 1.0}, "rt/diagnostics; 0: off [1/s].");
    visit("occupancy_low_m", occupancy_low_m, Range{-100, 100},
          "Lower end of the heights where a surface makes a cell of the grid occupied [m].");
    visit("occupancy_high_m", occupancy_high_m, Range{-100, 100},
          "Upper end of these heights [m].");
    visit("surface_points", surface_points, Range{1000, 50'000'000},
          "Most points of rt/pocd/surface; a larger surface is thinned.");
    visit("obstacle_lifetime_s", obstacle_lifetime_s, Range{0.1, 600.0},
          "How long an obstacle that is not sent again stays with the fleet manager [s].");
    visit("namespace", topic_namespace,
          "Takes the place of pocd in the names of these topics, but for rt/rmf_obstacles and "
          "rt/diagnostics, which several nodes may share.");
    visit("level_name", level_name, "Level of the building that the obstacles are on (Open-RMF).");
  }
  std::vector<std::string> inconsistencies() const;
};

struct NodeConfig {
  std::vector<RobotConfig> robots;
  bool discover_robots = false;
  TopicPatterns topics;
  std::string segmentation = "optional";
  std::string color = "absent";
  std::string map_frame = "map";
  int map_id = 0;
  double sync_wait_s = 0.3;
  double stamp_tolerance_s = 0.001;
  double extrapolation_s = 0.0;
  double max_pose_gap_s = 0.5;
  double merge_wait_s = 1.0;
  double silent_wait_s = 10.0;
  int queue_frames = 8;
  bool lossless = false;
  double object_period_s = 0.1;
  double map_period_s = 0.5;
  double map_rate_mb_s = 10.0;  // half of what a wireless link of a robot carries
  bool use_clock = false;
  RosOutputConfig outputs;
  MemoryConfig memory;
  double shutdown_wait_s = 10.0;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("robots", robots,
          "The robots whose cameras are listened to; none: all that appear on the bus.");
    visit("discover_robots", discover_robots,
          "Beside the named robots, listen to all others that appear on the bus.");
    visit.group("topics", topics, "Names of the input topics on the bus; {robot} is the name.");
    visit("segmentation", segmentation, Choices{{"absent", "optional", "required"}},
          "Segmentation images: not looked at, waited for and gone on without, or necessary.");
    visit("color", color, Choices{{"absent", "optional", "required"}}, "The same for colour.");
    visit("map_frame", map_frame, "Frame of the map: root of the poses.");
    visit("map_id", map_id, Range{0, 2'147'483'647},
          "Number of the map in every message: nodes on one domain must have different ones.");
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
    visit("silent_wait_s", silent_wait_s, Range{0.1, 3600.0},
          "A robot that sends no image for so long is not waited for by the others, and, in a "
          "lossless run, a silent stream not by its frames [s].");
    visit("queue_frames", queue_frames, Range{1, 10000},
          "Frames waiting for the pipeline; the oldest is dropped and counted.");
    visit("lossless", lossless,
          "Reliable readers that hold the player back instead of dropping frames.");
    visit("object_period_s", object_period_s, Range{0.0, 60.0},
          "Least time between two samples of one object [s].");
    visit("map_period_s", map_period_s, Range{0.0, 60.0}, "Least time between two map deltas [s].");
    visit("map_rate_mb_s", map_rate_mb_s, Range{0.01, 1000.0},
          "Most that map data takes of the network, all subscribers together, without what late "
          "joiners of the tiles get [MB/s].");
    visit("use_clock", use_clock,
          "Take the time of the topics under outputs from rt/clock, for replays (ROS: "
          "use_sim_time).");
    visit.group("outputs", outputs, "Topics that ROS 2 tools and fleet managers take as they are.");
    visit.group("memory", memory, "What is kept on disk from run to run.");
    visit("shutdown_wait_s", shutdown_wait_s, Range{0.0, 600.0},
          "How long to wait at the end for subscribers to acknowledge [s].");
  }
  std::vector<std::string> inconsistencies() const;

  /// Makes `names` the robots; one that `robots` has keeps its entry. Without names, nothing
  /// changes. Throws InputError.
  void set_robots(const std::vector<std::string>& names);

  /// Robots are found on the bus.
  bool discovers() const { return robots.empty() || discover_robots; }
};

/// A configuration file: the pipeline's groups at the top, as for pocd_map, and the group `node`.
struct NodeFile {
  PipelineConfig pipeline;
  NodeConfig node;

  template <class Visitor>
  void describe(Visitor& visit) {
    pipeline.describe(visit);
    visit.group("node", node, "The component on the bus.");
  }
};

}  // namespace pocd::dds

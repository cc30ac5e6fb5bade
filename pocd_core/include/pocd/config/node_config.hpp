// A configuration file: what the core needs, where frames come from, and how the component runs on
// the bus. The offline commands read the same files and use what concerns frames.
#pragma once

#include <string>
#include <vector>

#include "pocd/common/describe.hpp"
#include "pocd/input/input_config.hpp"
#include "pocd/memory/memory_config.hpp"
#include "pocd/pipeline/pipeline_config.hpp"

namespace pocd {

/// A rectangle on the ground, map frame; all 0: none.
struct GridExtentConfig {
  double min_x_m = 0.0, min_y_m = 0.0, max_x_m = 0.0, max_y_m = 0.0;

  bool given() const { return max_x_m > min_x_m && max_y_m > min_y_m; }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("min_x_m", min_x_m, Range{-100'000, 100'000}, "Left edge, map frame [m].");
    visit("min_y_m", min_y_m, Range{-100'000, 100'000}, "Lower edge [m].");
    visit("max_x_m", max_x_m, Range{-100'000, 100'000}, "Right edge [m].");
    visit("max_y_m", max_y_m, Range{-100'000, 100'000}, "Upper edge [m].");
  }
  std::vector<std::string> inconsistencies() const;
};

/// Form of the messages whose types differ between releases of ROS 2.
enum class RosRelease {
  kHumble,
  kIron,  ///< and all later ones
};
inline EnumWords<RosRelease> words_of(RosRelease) {
  return {{RosRelease::kHumble, "humble"}, {RosRelease::kIron, "iron"}};
}

/// Rates of the topics for others; 0 switches one off.
struct RosOutputConfig {
  double markers_hz = 1.0;
  double occupancy_hz = 1.0;
  double occupancy_whole_s = 5.0;
  double surface_hz = 0.5;
  double obstacles_hz = 1.0;
  double diagnostics_hz = 1.0;
  double twins_hz = 0.0;
  double occupancy_low_m = 0.1;
  double occupancy_high_m = 2.0;
  int occupancy_not_looked_at = -1;
  GridExtentConfig occupancy_extent;
  int surface_points = 2'000'000;
  double obstacle_lifetime_s = 3.0;
  double rate_mb_s = 10.0;
  std::string topic_namespace = "pocd";
  std::string level_name = "L1";
  RosRelease ros_release = RosRelease::kIron;
  std::string ros_node = "";

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("markers_hz", markers_hz, Range{0.0, 20.0}, "rt/pocd/objects/markers; 0: off [1/s].");
    visit("occupancy_hz", occupancy_hz, Range{0.0, 20.0},
          "rt/pocd/map and rt/pocd/map_updates, when the map has changed; 0: off [1/s].");
    visit(
        "occupancy_whole_s", occupancy_whole_s, Range{0.5, 3600.0},
        "After updates, the whole grid comes again when the last one is so old: receivers may have "
        "missed an update [s].");
    visit("surface_hz", surface_hz, Range{0.0, 20.0},
          "rt/pocd/surface, while it has subscribers and when the map has changed; 0: off [1/s].");
    visit("obstacles_hz", obstacles_hz, Range{0.0, 20.0}, "rt/rmf_obstacles; 0: off [1/s].");
    visit("diagnostics_hz", diagnostics_hz, Range{0.0, 1.0}, "rt/diagnostics; 0: off [1/s].");
    visit("twins_hz", twins_hz, Range{0.0, 20.0},
          "rt/pocd/objects (all objects, when one has changed), and with it rt/pocd/object_events "
          "and "
          "rt/pocd/health: the topics without rt/ for ROS 2, with messages of pocd_interfaces; 0: "
          "off "
          "[1/s].");
    visit("occupancy_low_m", occupancy_low_m, Range{-100, 100},
          "Lower end of the heights where a surface makes a cell of the grid occupied [m].");
    visit("occupancy_high_m", occupancy_high_m, Range{-100, 100},
          "Upper end of these heights [m].");
    visit("occupancy_not_looked_at", occupancy_not_looked_at, Range{-2, 100},
          "Value of a cell that is known from the memory and not looked at since the node started; "
          "-1: unknown, -2: as it was.");
    visit.group(
        "occupancy_extent", occupancy_extent,
        "What rt/pocd/map shows, to whole cells outwards, from the start on; all 0: what the "
        "map covers, growing with it.");
    visit("surface_points", surface_points, Range{1000, 50'000'000},
          "Most points of rt/pocd/surface; a larger surface is thinned.");
    visit("obstacle_lifetime_s", obstacle_lifetime_s, Range{0.1, 600.0},
          "How long an obstacle that is not sent again stays with the fleet manager [s].");
    visit("rate_mb_s", rate_mb_s, Range{0.01, 1000.0},
          "Most that grid and surface take of the network in the mean, all subscribers together; "
          "beyond it they come less often [MB/s].");
    visit("namespace", topic_namespace,
          "Takes the place of pocd in the names of these topics, but for rt/rmf_obstacles and "
          "rt/diagnostics, which several nodes may share.");
    visit("level_name", level_name, "Level of the building that the obstacles are on (Open-RMF).");
    visit("ros_release", ros_release,
          "Release of ROS 2 that messages have the form of where releases differ: humble, or iron "
          "and all later ones (jazzy, kilted, rolling). rt/rmf_obstacles has no header in humble, "
          "and ros_discovery_info has longer numbers.");
    visit(
        "ros_node", ros_node,
        "Name of the component as a node in the graph of ROS 2 (`ros2 node list`), such as pocd or "
        "/site/pocd; empty: it is none.");
  }
  std::vector<std::string> inconsistencies() const;
};

/// What only concerns the bus, beside the input.
struct NodeConfig : InputConfig {
  int map_id = 0;
  double silent_wait_s = 10.0;
  int queue_frames = 8;
  bool lossless = false;
  bool reliable_tf_and_info = false;
  double object_period_s = 0.1;
  double map_period_s = 0.5;
  double map_rate_mb_s = 10.0;  // half of what a wireless link of a robot carries
  bool use_clock = false;
  RosOutputConfig outputs;
  MemoryConfig memory;
  bool commands = false;
  double shutdown_wait_s = 10.0;
  double health_window_s = 10.0;
  double stall_s = 10.0;

  template <class Visitor>
  void describe(Visitor& visit) {
    InputConfig::describe(visit);
    visit("map_id", map_id, Range{0, 2'147'483'647},
          "Number of the map in every message: nodes on one domain must have different ones.");
    visit("silent_wait_s", silent_wait_s, Range{0.1, 3600.0},
          "A robot that sends no image for so long is not waited for by the others, and, in a "
          "lossless run, a silent stream not by its frames [s].");
    visit("queue_frames", queue_frames, Range{1, 10000},
          "Frames waiting for the pipeline; the oldest is dropped and counted.");
    visit("lossless", lossless,
          "Reliable readers that hold the player back instead of dropping frames.");
    visit("reliable_tf_and_info", reliable_tf_and_info,
          "Ask for tf, odometry and camera info reliably, so that what the network loses comes "
          "again; "
          "a sender that offers them best effort is not heard then (incompatible_qos).");
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
    visit("commands", commands,
          "Follow what operators say on pocd/command: whoever may write there changes the map.");
    visit("shutdown_wait_s", shutdown_wait_s, Range{0.0, 600.0},
          "How long to wait at the end for subscribers to acknowledge [s].");
    visit("health_window_s", health_window_s, Range{0.1, 3600.0},
          "How long something that went wrong counts for the level of pocd/health [s].");
    visit("stall_s", stall_s, Range{0.1, 3600.0},
          "A thread of the node, or Fast DDS's discovery, that has not ended a turn for so long "
          "hangs: level 2, and not ready [s].");
  }
};

/// A configuration file: the pipeline's groups at the top, and the group `node`.
struct NodeFile {
  PipelineConfig pipeline;
  NodeConfig node;

  template <class Visitor>
  void describe(Visitor& visit) {
    pipeline.describe(visit);
    visit.group("node", node, "Where frames come from, and the component on the bus.");
  }
};

}  // namespace pocd

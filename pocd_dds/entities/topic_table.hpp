// Every topic of the component: name, type, quality of service, direction. Nothing else names one.
#pragma once

#include <string>
#include <string_view>

#include "pocd/input/input_config.hpp"
#include "pocd/input/robot_topic.hpp"

namespace pocd::dds {

/// What the table says about delivery. Everything not listed here is the same for all topics.
struct Delivery {
  bool reliable = true;
  bool transient_local = false;
  int keep_last = 1;        ///< 0: keep all, bounded by max_samples
  int max_samples = 0;      ///< 0: not bounded
  int max_instances = 0;    ///< of keyed topics; 0: not bounded
  bool background = false;  ///< sent, and sent again, by a thread of its own
  double deadline_s = 0.0;  ///< 0: none
  /// Of keyed topics that keep all: 0: not bounded. Fast DDS makes no reader whose max_samples is
  /// less than this times max_instances.
  int max_samples_per_instance = 0;
};

enum class Direction { kIn, kOut, kBoth };

/// `name` may hold {robot}, which pocd::robot_topic() replaces.
struct TopicSpec {
  const char* name;
  const char* type;
  Direction direction;
  bool keyed;
  Delivery delivery;
};

namespace topics {

constexpr Delivery best_effort(int keep_last) { return {false, false, keep_last, 0, 0, false, 0}; }
constexpr Delivery reliable(int keep_last) { return {true, false, keep_last, 0, 0, false, 0}; }
constexpr Delivery latched(int keep_last, int max_instances = 0) {
  return {true, true, keep_last, 0, max_instances, false, 0};
}

inline constexpr TopicSpec kDepth{input_names::kDepth, "sensor_msgs::msg::dds_::Image_",
                                  Direction::kIn, false, best_effort(5)};
/// What the image topics may have instead.
inline constexpr char kCompressedImageType[] = "sensor_msgs::msg::dds_::CompressedImage_";
inline constexpr TopicSpec kCameraInfo{input_names::kCameraInfo,
                                       "sensor_msgs::msg::dds_::CameraInfo_", Direction::kIn, false,
                                       best_effort(5)};
inline constexpr TopicSpec kSegmentation{input_names::kSegmentation,
                                         "sensor_msgs::msg::dds_::Image_", Direction::kIn, false,
                                         best_effort(5)};
inline constexpr TopicSpec kColor{input_names::kColor, "sensor_msgs::msg::dds_::Image_",
                                  Direction::kIn, false, best_effort(5)};
inline constexpr TopicSpec kOdometry{input_names::kOdometry, "nav_msgs::msg::dds_::Odometry_",
                                     Direction::kIn, false, best_effort(20)};
inline constexpr TopicSpec kTf{input_names::kTf, "tf2_msgs::msg::dds_::TFMessage_", Direction::kIn,
                               false, best_effort(100)};
// Every broadcaster says its transforms once and for all: not one sample may make room for another.
// A reader that is full has the others sent again when it has been emptied.
inline constexpr TopicSpec kTfStatic{input_names::kTfStatic,
                                     "tf2_msgs::msg::dds_::TFMessage_",
                                     Direction::kIn,
                                     false,
                                     {true, true, 0, 10000, 0, false, 0}};
inline constexpr TopicSpec kClock{"rt/clock", "rosgraph_msgs::msg::dds_::Clock_", Direction::kBoth,
                                  false, reliable(1)};

inline constexpr TopicSpec kObjects{"pocd/objects", "pocd_msgs::msg::dds_::ObjectState_",
                                    Direction::kOut, true, latched(1, 20000)};
inline constexpr TopicSpec kObjectEvents{"pocd/object_events", "pocd_msgs::msg::dds_::ObjectEvent_",
                                         Direction::kOut, false, reliable(1000)};
inline constexpr TopicSpec kFrames{"pocd/frames", "pocd_msgs::msg::dds_::FrameRecord_",
                                   Direction::kOut, false, reliable(1000)};
inline constexpr TopicSpec kMapTiles{"pocd/map/tiles",
                                     "pocd_msgs::msg::dds_::MapTile_",
                                     Direction::kOut,
                                     true,
                                     {true, true, 1, 0, 0, true, 0}};
inline constexpr TopicSpec kMapDeltas{"pocd/map/deltas", "pocd_msgs::msg::dds_::MapDelta_",
                                      Direction::kOut, false, reliable(1000)};
inline constexpr TopicSpec kMapManifest{"pocd/map/manifest", "pocd_msgs::msg::dds_::MapManifest_",
                                        Direction::kOut, true, latched(1)};
inline constexpr TopicSpec kMapLooks{"pocd/map/looks", "pocd_msgs::msg::dds_::MapLooks_",
                                     Direction::kOut, true, latched(1)};
inline constexpr TopicSpec kSnapshotRequest{"pocd/map/snapshot_request",
                                            "pocd_msgs::msg::dds_::MapSnapshotRequest_",
                                            Direction::kBoth, false, reliable(10)};
// A reply may have many parts, and all of them have to arrive.
inline constexpr TopicSpec kSnapshotReply{"pocd/map/snapshot_reply",
                                          "pocd_msgs::msg::dds_::MapSnapshotReply_",
                                          Direction::kBoth, false, reliable(1000)};
inline constexpr TopicSpec kEventsRequest{"pocd/events_request",
                                          "pocd_msgs::msg::dds_::EventsRequest_", Direction::kBoth,
                                          false, reliable(10)};
inline constexpr TopicSpec kEventsReply{"pocd/events_reply", "pocd_msgs::msg::dds_::EventsReply_",
                                        Direction::kBoth, false, reliable(100)};
inline constexpr TopicSpec kCommand{"pocd/command", "pocd_msgs::msg::dds_::Command_",
                                    Direction::kBoth, false, reliable(100)};
inline constexpr TopicSpec kCommandReply{"pocd/command_reply",
                                         "pocd_msgs::msg::dds_::CommandReply_", Direction::kBoth,
                                         false, reliable(100)};
inline constexpr TopicSpec kHealth{"pocd/health",
                                   "pocd_msgs::msg::dds_::NodeHealth_",
                                   Direction::kOut,
                                   true,
                                   {true, true, 1, 0, 0, false, 1.5}};
// The same for ROS 2, which knows neither keys nor disposes.
inline constexpr TopicSpec kRosObjects{"rt/pocd/objects", "pocd_interfaces::msg::dds_::ObjectList_",
                                       Direction::kOut, false, latched(1)};
inline constexpr TopicSpec kRosObjectEvents{"rt/pocd/object_events",
                                            "pocd_interfaces::msg::dds_::ObjectEvent_",
                                            Direction::kOut, false, reliable(1000)};
inline constexpr TopicSpec kRosHealth{"rt/pocd/health", "pocd_interfaces::msg::dds_::NodeHealth_",
                                      Direction::kOut, false, latched(1)};
inline constexpr TopicSpec kDiagnostics{"rt/diagnostics",
                                        "diagnostic_msgs::msg::dds_::DiagnosticArray_",
                                        Direction::kOut, false, reliable(10)};
inline constexpr TopicSpec kMarkers{"rt/pocd/objects/markers",
                                    "visualization_msgs::msg::dds_::MarkerArray_", Direction::kOut,
                                    false, latched(1)};
inline constexpr TopicSpec kOccupancy{"rt/pocd/map", "nav_msgs::msg::dds_::OccupancyGrid_",
                                      Direction::kOut, false, latched(1)};
inline constexpr TopicSpec kOccupancyUpdates{"rt/pocd/map_updates",
                                             "map_msgs::msg::dds_::OccupancyGridUpdate_",
                                             Direction::kOut, false, reliable(10)};
inline constexpr TopicSpec kSurface{"rt/pocd/surface", "sensor_msgs::msg::dds_::PointCloud2_",
                                    Direction::kOut, false, latched(1)};
inline constexpr TopicSpec kRmfObstacles{"rt/rmf_obstacles",
                                         "rmf_obstacle_msgs::msg::dds_::Obstacles_",
                                         Direction::kOut, false, best_effort(10)};

// ROS 2's own: which endpoint belongs to which node of its graph.
inline constexpr TopicSpec kRosGraph{"ros_discovery_info",
                                     "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
                                     Direction::kOut, false, latched(1)};

/// rt/pocd/map in another namespace; what several nodes may share stays.
inline std::string in_namespace(const TopicSpec& spec, const std::string& topic_namespace) {
  constexpr std::string_view kDefault = "rt/pocd/";
  const std::string_view name = spec.name;
  if (name.substr(0, kDefault.size()) != kDefault) return spec.name;
  return "rt/" + topic_namespace + "/" + std::string(name.substr(kDefault.size()));
}

}  // namespace topics

}  // namespace pocd::dds

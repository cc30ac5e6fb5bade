// What one frame changed: the whole output of the core, for publishers, files and tests.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pocd/belief/belief.hpp"
#include "pocd/common/types.hpp"

namespace pocd {

/// A library object as others see it.
struct ObjectSnapshot {
  ObjectId id = ObjectId::kNone;
  ClassId class_id = 0;
  int stationarity_class = 0;                            ///< s: 0 movable, 1 static
  OrientedBox box;                                       ///< map frame
  Eigen::Vector3d centroid_W = Eigen::Vector3d::Zero();  ///< mean of the mapped surface points [m]
  /// The 4-DoF pose: x, y and heading of the box, and the mean height of the surface, which does
  /// not depend on how much of the foot is hidden.
  Pose4 pose() const {
    return {{box.pose.position_W.x(), box.pose.position_W.y(), centroid_W.z()}, box.pose.yaw_rad};
  }
  Belief belief;
  StampNs first_seen_ns = 0;
  StampNs last_seen_ns = 0;
  std::uint32_t observations = 0;
  std::string last_robot;            ///< namespace of the robot that saw it last
  std::vector<std::string> seen_by;  ///< the robots that have seen it, 100 at most, by name
  /// Seen since the program started: false for what is known from a memory only. Set by publishers.
  bool seen_in_run = true;
  bool forgotten = false;  ///< by an operator's word: nobody has seen it go. Set by publishers.
};

/// kOperator: somebody said something of the map (operator_word.hpp; `rule` says what). With an
/// object: nothing is known of it any more, and nobody has seen it go.
enum class EventKind { kAdded, kUpdated, kMoved, kRemoved, kOperator };
const char* to_string(EventKind kind);  ///< "ADDED", "UPDATED", "MOVED", "REMOVED"

/// Whether a thing came to its place while the system knew of the place.
enum class Arrival : std::uint8_t {
  kUnknown,  ///< part of its place was seen empty before, part of it was never seen
  kFound,    ///< its place was never seen empty: it may always have stood there
  kArrived,  ///< its place was seen empty before
};
const char* to_string(Arrival arrival);  ///< "unknown", "found", "arrived"

/// Why an event happened: enough to recompute the belief step that made it.
struct Evidence {
  double delta_m = 0.0;             ///< measured geometric change
  int stationarity_class = 0;       ///< s of the measurement
  double k = 0.0;                   ///< weight of the semantic likelihood
  double c1 = 0.0;                  ///< inlier probability of the measurement
  double c2 = 0.0;                  ///< outlier probability, c1 + c2 = 1
  double visible_share = 0.0;       ///< of the object's points that this frame had evidence about
  double seen_through_share = 0.0;  ///< of those, the share the camera saw through
  double measurement_sigma_m = 0.0;
  Belief before, after;
  std::string rule;  ///< name of the lifecycle rule that fired, e.g. "stationarity_below_threshold"
};

struct ObjectEvent {
  std::uint64_t sequence = 0;  ///< 1, 2, ... within a run
  EventKind kind = EventKind::kAdded;
  ObjectId object = ObjectId::kNone;
  ClassId class_id = 0;
  StampNs stamp_ns = 0;  ///< of the frame that caused it
  std::uint64_t frame_sequence = 0;
  std::string robot;
  OrientedBox box;                          ///< now (for REMOVED: the last one)
  std::optional<OrientedBox> previous_box;  ///< MOVED: where it was
  /// An object that was reported as ADDED before and turned out to be this one; its id is retired.
  std::optional<ObjectId> absorbed;
  /// ADDED: whether it came while the system knew of the place. Unknown for other kinds.
  Arrival arrival = Arrival::kUnknown;
  Evidence evidence;
  /// REMOVED, MOVED: it went between the last look that found it in its place and the first one of
  /// those that found the place empty. 0: not known.
  StampNs last_there_ns = 0, first_gone_ns = 0;
  std::string by;  ///< who said so; empty: cameras saw it
};

/// A stage and the time it took, by the clock and of all its threads' processors; never used in a
/// decision.
struct StageTiming {
  const char* stage = "";
  double wall_ms = 0.0;
  double cpu_ms = 0.0;
};

struct FrameResult {
  bool accepted = true;  ///< false: the frame was refused as a whole, see warnings
  std::vector<ObjectEvent> events;
  /// Confirmed library entries that are new or changed, by id.
  std::vector<ObjectSnapshot> changed_objects;
  /// Ids that left the library: removed (with an event), moved under their old id, or found to be a
  /// part of another object (its event is UPDATED). Ascending.
  std::vector<ObjectId> retired;
  std::vector<StageTiming> timings;
  /// One line each, e.g. "pose jump of 0.31 m: frame not used for object states".
  std::vector<std::string> warnings;
};

}  // namespace pocd

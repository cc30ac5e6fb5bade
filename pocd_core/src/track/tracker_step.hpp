// What the parts of ObjectTracker share while one frame is worked on.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "object_tracker.hpp"

namespace pocd {

struct ObjectTracker::Step {
  const Frame& frame;
  const OrganizedCloud& cloud;
  const DepthField& field;
  const Observations& observations;
  const GroundModel& ground;
  const DistanceAt& distance_at;
  MapEdits& edits;
  FrameResult& result;
  SightConfig sight;
  std::size_t look_count = 0;
  std::vector<Part> parts;
  /// Owner of each part; kNone while that is open.
  std::vector<ObjectId> owners;
  std::vector<Move> moves;  ///< of this frame
  /// Evidence of this frame's measurement, by object.
  std::map<ObjectId, Evidence> evidence;
};

/// Share of a found object that lies within another one's box when it is another side of it.
inline constexpr double kInsideShare = 0.6;

/// A point in a camera's image: its depth, and the one that was measured at its pixel (0: none)
/// [m].
struct PixelView {
  double depth_m = 0.0;
  double measured_m = 0.0;
};
/// Nothing when the point [m, W] is not in front of the camera or outside of the image. `T_C_W`:
/// the inverse of the cloud's pose, made once for many points.
std::optional<PixelView> view_of(const OrganizedCloud& cloud, const Pose& T_C_W,
                                 const Eigen::Vector3d& point_W);

/// Where a box was before a motion.
OrientedBox box_before(const OrientedBox& box, const Pose& T_new_old);

/// The surfels after a motion [m, W]; none of them has been seen through there.
std::vector<Surfel> moved_surfels(const std::vector<Surfel>& surfels, const Pose& T_new_old);

/// Share of the surfels that lie in the box, grown by `margin_m` on all sides.
double inside_share(const std::vector<Surfel>& surfels, const OrientedBox& box, double margin_m);

/// About so many of the marked surfels (1: marked), spread evenly over all of them.
std::vector<const Surfel*> some_surfels(const std::vector<Surfel>& surfels,
                                        const std::vector<std::uint8_t>& marked, std::size_t about);

/// Whether the point [m, W] lies before most of the surface, by more than `before_m`.
bool is_before(const std::vector<const Surfel*>& surface, const Eigen::Vector3f& point_W,
               double before_m);
/// Whether most of the points do.
bool lie_before(const std::vector<const Surfel*>& points, const std::vector<const Surfel*>& surface,
                double before_m);

}  // namespace pocd

// One look at one object: what the frame says about its surface, and what follows from that.
#pragma once

#include <optional>

#include "pocd/belief/change_config.hpp"
#include "pocd/objects/object_library.hpp"
#include "pocd/observe/association_config.hpp"
#include "pocd/observe/visibility.hpp"

namespace pocd {

/// What one frame says about an object. Resemblance elsewhere says nothing: only what the camera
/// measured at the object's own place counts.
enum class Verdict {
  kTooLittleSeen,  ///< too few of its points are in view to say anything
  kHidden,         ///< they are in view, but something stands before them
  kInPlace,        ///< its surface was measured where it was
  kDisplaced,      ///< it was measured beside its place, turned or shifted a little
  kUnobserved,     ///< most of what is visible of its place was seen through
};
const char* to_string(Verdict verdict);

struct Look {
  LibraryObject* object = nullptr;
  Sighting sighting;
  Verdict verdict = Verdict::kTooLittleSeen;
  /// A good part of what is seen contradicts its surface: nothing grows on it then.
  bool contested = false;
  /// What was measured within its box lies on its surface. Where it does not, another thing stands
  /// there, and what coincides with the surface says nothing for the object.
  bool fits = true;
  /// The observation that holds most of its measured points, or Observations::kNone.
  std::int32_t observation = Observations::kNone;
  /// kDisplaced: the motion that explains the frame [m, W], how far it takes the points [m], and
  /// +1 when towards the camera, -1 when away.
  Pose T_new_old = Pose::Identity();
  double displacement_m = 0.0;
  int sign = 1;
};

/// Whether a point lies in the box, grown by a margin on all sides.
bool is_inside(const OrientedBox& box, double margin_m, const Eigen::Vector3f& point_W);

/// Fills `look` from its object's surface, except for the alignment.
void judge(const OrganizedCloud& cloud, const DepthField& field, const Observations& observations,
           const SightConfig& sight, const DepthNoise& noise, Look& look);

/// For an object whose place is contested: aligns what was measured around it with its surface
/// (point-to-plane ICP). When the surface, moved so, explains the frame, the verdict becomes
/// kDisplaced. The old place must be seen empty in part, or be taken by the new one: two solid
/// things are not in one place. `least_m`: shorter motions are noise [m]. `looks`: the frame's,
/// judged; what lies on other objects in their places is not aligned.
void align(const OrganizedCloud& cloud, const DepthField& field, const Observations& observations,
           const SightConfig& sight, const DepthNoise& noise, const AssociationConfig& config,
           double least_m, const Look* looks, std::size_t count, Look& look);

}  // namespace pocd

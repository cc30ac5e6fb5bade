// How an object that is found beside its place has moved, by alignment.
#pragma once

#include <optional>
#include <vector>

#include "pocd/objects/object_library.hpp"
#include "pocd/observe/association_config.hpp"
#include "pocd/observe/visibility.hpp"
#include "pocd/registration/icp_target.hpp"

namespace pocd {

struct Match {
  /// Motion of the object that explains the observation [m, rad]; identity when it lies where it
  /// was.
  Pose T_new_old = Pose::Identity();
  /// Mean displacement of the observation's points under that motion [m]; 0 when it lies where it
  /// was.
  double displacement_m = 0.0;
  /// Positive when the observation is in front of the object seen from the camera, as published.
  int sign = 1;
};

/// Surfels as the prepared side of an alignment, see IcpTarget.
IcpTarget icp_target(const std::vector<Surfel>& surfels, double inlier_distance_m,
                     double max_correspondence_m);

/// How an object that is still about where it was may have moved: point-to-plane ICP from `start`
/// (takes the observation to the object), which moves it along no direction that its surface leaves
/// open. Nothing when it does not fit.
std::optional<Match> align_in_place(LibraryObject& object, const Observation& observation,
                                    const Pose& T_W_C, const Pose& start,
                                    const AssociationConfig& config);

}  // namespace pocd

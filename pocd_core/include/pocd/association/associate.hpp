// Step 4 of the method: which observation is which object.
#pragma once

#include <optional>
#include <vector>

#include "pocd/association/association_config.hpp"
#include "pocd/association/visibility.hpp"
#include "pocd/map/object_library.hpp"

namespace pocd {

/// An object near enough to matter for this frame, with what the frame says about its points.
struct Candidate {
  LibraryObject* object = nullptr;
  Sighting sighting;
};

struct Match {
  std::size_t candidate = 0;
  std::int32_t observation = 0;
  /// Motion of the object that explains the observation [m, rad]; identity when it lies where it
  /// was.
  Pose T_new_old = Pose::Identity();
  /// Mean displacement of the observation's points under that motion [m]; 0 when it lies where it
  /// was.
  double displacement_m = 0.0;
  /// Positive when the observation is in front of the object seen from the camera, as published.
  int sign = 1;
  double cost = 0.0;
  bool stationary = true;
};

struct AssociationResult {
  std::vector<Match> matches;  ///< one to one, optimal; by candidate
  /// Other observations of an object that is matched or seen in place: pieces of it.
  struct Piece {
    std::int32_t observation;
    std::size_t candidate;
  };
  std::vector<Piece> pieces;
  std::vector<std::int32_t> unassigned;  ///< observations of no known object, ascending
  /// Per candidate: most of what is visible of it is seen through, or a good part is while the
  /// observations near it do not fit it either.
  std::vector<bool> doubtful;
};

/// How an object that is still about where it was may have moved: point-to-plane ICP from its
/// place, which moves it along no direction that its surface leaves open. Nothing when it does not
/// fit.
std::optional<Match> align_in_place(LibraryObject& object, const Observation& observation,
                                    const Pose& T_W_C, const AssociationConfig& config);

/// Pairs within the gates (class, centroid distance or overlapping boxes). An object that most of
/// its visible points say is in place matches the observation that they hit, without ICP; one that
/// is in doubt is aligned by point-to-plane ICP and costs lambda_translation |t| + lambda_rotation
/// |angle|
/// + lambda_class [classes differ]. Costs above the cutoff and dissimilarities above the limit are
/// no pair. The assignment is optimal over the gated pairs.
AssociationResult associate(const Candidate* candidates, std::size_t count,
                            const Observations& observations, const Pose& T_W_C,
                            const AssociationConfig& config);

}  // namespace pocd

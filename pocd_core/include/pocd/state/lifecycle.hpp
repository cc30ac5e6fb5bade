// Rules of an object's life: how a measurement changes its belief, and when it is removed or has
// moved.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>

#include "pocd/association/visibility.hpp"
#include "pocd/change/change_config.hpp"
#include "pocd/map/object_library.hpp"
#include "pocd/state/bayesian_update.hpp"
#include "pocd/state/state_config.hpp"

namespace pocd {

/// Steps 6 of the method: k by class and kind of measurement, the Bayesian update, the bound v_max,
/// the cap of alpha + beta, the floor of sigma. `sigma_m`: standard deviation of the measured
/// change. Changes object.belief and returns why, without a rule.
Evidence apply_measurement(LibraryObject& object, double delta_m, double sigma_m,
                           const Sighting& sighting, const StateConfig& state,
                           const ChangeConfig& change);

/// The belief after one measurement, as apply_measurement makes it: every published transition can
/// be recomputed with it from the evidence alone.
Belief next_belief(const Belief& before, const Measurement& measurement, const StateConfig& state,
                   const ChangeConfig& change);

/// Name of the rule by which the object is to be removed now, if any:
/// "stationarity_below_threshold", "change_established", "nothing_left", "never_confirmed",
/// "candidate_seen_through".
std::optional<std::string> removal_rule(const LibraryObject& object, const StateConfig& state,
                                        const ChangeConfig& change);

/// True when two boxes may be the same thing seen in part: heights and both horizontal sizes agree
/// within 35 % or `slack_m`, whichever is more.
bool alike(const OrientedBox& a, const OrientedBox& b, double slack_m);

/// True when `part` may be a partial view of `whole`: no size of it is larger by more than 20 % or
/// `slack_m`.
bool fits_inside(const OrientedBox& part, const OrientedBox& whole, double slack_m);

/// True when a side of `part` seen face on (a horizontal size and the height) is a side of `whole`,
/// each within 20 % or `slack_m`.
bool same_side(const OrientedBox& part, const OrientedBox& whole, double slack_m);

/// Whether a box stands between an eye and a point [m, W].
bool hides(const OrientedBox& box, const Eigen::Vector3d& eye_W, const Eigen::Vector3d& point_W);

/// The box with horizontal sizes of at least `least_m`, extended away from the eye: of a thing that
/// was seen from one side only its near face is known.
OrientedBox filled(const OrientedBox& box, const Eigen::Vector3d& eye_W, double least_m);

/// Where all of a thing must be of which only `part` is seen after it moved from `known`: as large
/// as it was, on the seen side of what is seen, and no farther along it from its old place than
/// needed.
OrientedBox completed_box(const OrientedBox& part, const OrientedBox& known,
                          const Eigen::Vector3d& eye_W, double least_m);

/// Remembers what was removed, so that a like object that turns up is reported as moved.
class RelocationMemory {
 public:
  struct Removed {
    ObjectId id;
    ClassId class_id;
    OrientedBox box;
    StampNs first_seen_ns;
    StampNs verified_ns;
    StampNs contested_since_ns;
    StampNs removed_ns;
    std::set<std::string> seen_by = {};
  };
  void remember(const Removed& removed) { removed_.push_back(removed); }

  /// What was removed within the last `window_s` before `now_ns` [s], oldest first; older entries
  /// are forgotten. Valid until the next call.
  const std::deque<Removed>& recent(StampNs now_ns, double window_s);
  void forget(ObjectId id);
  /// Nothing that is remembered happened after `latest_ns`.
  void set_clock_back(StampNs latest_ns);

 private:
  friend struct ArchiveAccess;
  std::deque<Removed> removed_;
};

}  // namespace pocd

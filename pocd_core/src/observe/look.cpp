#include "pocd/observe/look.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/observe/align_in_place.hpp"

namespace pocd {
namespace {

/// Fewer points than this say nothing.
constexpr int kLeastPoints = 5;
/// What decides about most of what is seen.
constexpr double kMajority = 0.5;
/// A place is contested when this share of what is seen of it is seen through or covered.
constexpr double kContestedShare = 0.2;
/// From this share on it is asked whether what stands there fits its surface.
constexpr double kDoubtfulShare = 0.1;
/// What was measured within its box fits the surface of an object that is in its place.
constexpr double kFittingShare = 0.75;
/// A like surface that is nearer than this share of the thing's size leaves no room for two.
constexpr double kTakenShare = 0.5;
constexpr std::size_t kFitBudget = 200;
/// Points of a surface lie within so many spacings of a surfel, beside their noise.
constexpr double kFitSpacings = 0.75;
/// The surface at its new place explains the frame when no more than this share of it is seen
/// through, and it is measured in at least so many points as this share of what was measured there.
constexpr double kLeftOverShare = 0.15;
constexpr double kExplainedShare = 0.6;
/// At most this share of what was measured may lie on sides that were not known.
constexpr double kUnseenShare = 0.35;
/// A new object's first surfels were measured once; later ones bear witness after the second time.
constexpr std::uint32_t kYoungObservations = 2;

int min_hits(const LibraryObject& object) {
  return object.observations > kYoungObservations ? 2 : 1;
}

/// Points at pixels that masks give to another thing: measured, but not of this object. Of another
/// class, only when most of its points are: masks err at the borders of things.
int measured_otherwise(const Sighting& s, const Observations& observations, ClassId class_id,
                       std::int32_t own) {
  const bool by_instance = own != Observations::kNone && observations.list[own].instance != 0;
  int of_instance = 0, of_class = 0;
  for (const auto& t : s.touches) {
    const Observation& other = observations.list[t.observation];
    if (by_instance && t.observation != own && other.instance != 0) {
      of_instance += t.hit;
    } else if (class_id != kThing && other.class_id != kThing && other.class_id != class_id) {
      of_class += t.hit;
    }
  }
  return of_instance + (of_class > kMajority * s.hit ? of_class : 0);
}

struct Tally {
  int here = 0;     ///< measured in place
  int through = 0;  ///< seen through
  int covered = 0;  ///< measured as another thing, or covered by one of the same class
  double contested_share() const {
    const int all = here + through + covered;
    return all > 0 ? static_cast<double>(through + covered) / all : 0.0;
  }
};

Tally tally_of(const Sighting& s, const Observations& observations, ClassId class_id,
               std::int32_t own) {
  Tally tally;
  const int other = measured_otherwise(s, observations, class_id, own);
  tally.here = s.hit - other;
  tally.through = s.seen_through;
  tally.covered = other;
  for (const auto& t : s.touches) {
    if (observations.list[t.observation].class_id == class_id) tally.covered += t.in_front;
  }
  return tally;
}

std::int32_t main_observation(const Sighting& s, const Observations& observations,
                              ClassId class_id) {
  std::int32_t best = Observations::kNone;
  int most = 0;
  for (const auto& t : s.touches) {
    if (observations.list[t.observation].class_id != class_id) continue;
    const int points = 2 * t.hit + t.in_front;  // what is measured tells more than what covers
    if (points > most) most = points, best = t.observation;
  }
  return best;
}

/// Share of the observation's points within the object's box that lie on its surface.
double fit_in_box(const LibraryObject& object, const Observation& observation) {
  const double spacing_m = object.model.spacing_m();
  int within = 0, on = 0;
  const std::size_t step = std::max<std::size_t>(1, observation.points.size() / kFitBudget);
  for (std::size_t i = 0; i < observation.points.size(); i += step) {
    const SurfacePoint& p = observation.points[i];
    if (!is_inside(object.box, spacing_m, p.point_W)) continue;
    ++within;
    const auto radius = static_cast<float>(kFitSpacings * spacing_m) + 2.0f * p.sigma_m;
    on += object.model.nearest(p.point_W, radius) != ObjectModel::kNone;
  }
  return within > 0 ? static_cast<double>(on) / within : 0.0;
}

}  // namespace

bool is_inside(const OrientedBox& box, double margin_m, const Eigen::Vector3f& point_W) {
  const Eigen::AngleAxisd turn(-box.pose.yaw_rad, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d at = turn * (point_W.cast<double>() - box.pose.position_W);
  return ((at.cwiseAbs() - 0.5 * box.size_m).array() <= margin_m).all();
}

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kTooLittleSeen:
      return "too_little_seen";
    case Verdict::kHidden:
      return "hidden";
    case Verdict::kInPlace:
      return "in_place";
    case Verdict::kDisplaced:
      return "displaced";
    case Verdict::kUnobserved:
      return "unobserved";
  }
  return "";
}

void judge(const OrganizedCloud& cloud, const DepthField& field, const Observations& observations,
           const SightConfig& sight, const DepthNoise& noise, Look& look) {
  const LibraryObject& object = *look.object;
  sight_object(object.model.surfels(), min_hits(object), cloud, field, observations, sight, noise,
               look.sighting);
  const Sighting& s = look.sighting;
  look.verdict = Verdict::kTooLittleSeen;
  look.contested = false;
  look.T_new_old = Pose::Identity();
  look.displacement_m = 0.0;
  look.observation = main_observation(s, observations, object.class_id);
  const Tally tally = tally_of(s, observations, object.class_id, look.observation);
  look.contested = tally.contested_share() > kContestedShare;
  look.fits = tally.contested_share() < kDoubtfulShare || look.observation == Observations::kNone ||
              fit_in_box(object, observations.list[look.observation]) >= kFittingShare;
  const int visible = tally.here + tally.through;
  if (visible < kLeastPoints) {
    if (s.occluded + tally.covered >= kLeastPoints) look.verdict = Verdict::kHidden;
  } else if (tally.through > kMajority * visible) {
    look.verdict = Verdict::kUnobserved;
  } else if (!look.fits && tally.through >= kLeastPoints &&
             tally.through > kContestedShare * visible) {
    look.verdict = Verdict::kUnobserved;
  } else {
    look.verdict = Verdict::kInPlace;
  }
}

void align(const OrganizedCloud& cloud, const DepthField& field, const Observations& observations,
           const SightConfig& sight, const DepthNoise& noise, const AssociationConfig& config,
           double least_m, const Look* looks, std::size_t count, Look& look) {
  if (!look.contested || look.observation == Observations::kNone) return;
  LibraryObject& object = *look.object;
  const double spacing_m = object.model.spacing_m();
  // What lies around the object; a neighbour that is one piece with it in the image stays out.
  Observation around;
  for (const SurfacePoint& p : observations.list[look.observation].points) {
    if (!is_inside(object.box, config.icp_max_distance_m, p.point_W)) continue;
    const bool of_another = std::any_of(looks, looks + count, [&](const Look& other) {
      return other.object != &object && other.object->confirmed &&
             other.verdict == Verdict::kInPlace && !other.contested &&
             other.object->arrival != Arrival::kArrived &&
             is_inside(other.object->box, spacing_m, p.point_W) &&
             other.object->model.nearest(p.point_W, static_cast<float>(1.5 * spacing_m)) !=
                 ObjectModel::kNone;
    });
    if (!of_another) around.points.push_back(p);
  }
  if (around.points.size() < static_cast<std::size_t>(2 * kLeastPoints)) return;
  const Tally before = tally_of(look.sighting, observations, object.class_id, look.observation);
  // Too little of its old place is seen to tell.
  const int told = before.here + before.through + before.covered;
  if (told < 2 * kLeastPoints) return;

  // A wall says nothing of how far it slid along itself: each end may be the one that is seen.
  const Eigen::Vector3d along_W = long_axis(object.box);
  double low = 1e9, high = -1e9;
  for (const SurfacePoint& p : around.points) {
    const double at = (p.point_W.cast<double>() - object.box.pose.position_W).dot(along_W);
    low = std::min(low, at), high = std::max(high, at);
  }
  const double half = 0.5 * longest_side(object.box);
  // Sides that were never seen before lie off the known surface.
  AssociationConfig loose = config;
  loose.max_dissimilarity = kUnseenShare;
  int most = 0;
  for (const double slid_m : {0.0, high - half, low + half}) {
    if (slid_m != 0.0 && (std::abs(slid_m) < least_m || std::abs(slid_m) > config.max_distance_m))
      continue;
    Pose start = Pose::Identity();
    start.translation() = -slid_m * along_W;
    const auto match = align_in_place(object, around, cloud.T_W_C, start, loose);
    if (!match || match->displacement_m < least_m || match->displacement_m > config.max_distance_m)
      continue;
    // An edge that fits says nothing of where the rest went.
    const Eigen::Vector3d& center_W = object.box.pose.position_W;
    if ((match->T_new_old * center_W - center_W).norm() > match->displacement_m + 2.0 * least_m)
      continue;
    // Nothing of the old place is seen empty: then the new one must cover it and leave no room for
    // both, however thick the thing is behind its known side.
    const bool covers = before.through < kLeastPoints;
    const double side_m = std::min(longest_side(object.box), object.box.size_m.z());
    if (covers &&
        (before.covered <= kMajority * told || match->displacement_m > kTakenShare * side_m)) {
      continue;
    }
    std::vector<Surfel> moved = object.model.surfels();
    const Eigen::Isometry3f T = match->T_new_old.cast<float>();
    for (Surfel& s : moved) {
      s.point_W = T * s.point_W;
      s.normal_W = T.linear() * s.normal_W;
    }
    static thread_local Sighting there;
    sight_object(moved, min_hits(object), cloud, field, observations, sight, noise, there);
    const Tally after = tally_of(there, observations, object.class_id, look.observation);
    const int in_view = after.here + after.through + there.occluded + there.unknown;
    if (after.here < kMajority * in_view || after.here < config.min_visible_share * there.total)
      continue;
    if (after.through > kLeftOverShare * (after.here + after.through) || after.here < before.here ||
        after.here < kExplainedShare * static_cast<double>(around.points.size()) ||
        after.here - after.through <= most) {
      continue;
    }
    most = after.here - after.through;
    look.verdict = Verdict::kDisplaced;
    look.T_new_old = match->T_new_old;
    look.displacement_m = match->displacement_m;
    look.sign = match->sign;
  }
}

}  // namespace pocd

#include "pocd/association/associate.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/association/assignment.hpp"
#include "pocd/association/point_to_plane_icp.hpp"

namespace pocd {
namespace {

/// Share of what is visible of an object that decides for it: above one half is a majority.
constexpr double kMajority = 0.5;
/// Fewer visible points than this decide nothing.
constexpr int kMinVisible = 5;
/// Share of an observation near an object's surface that makes it a piece of that object.
constexpr double kPieceShare = 0.3;
constexpr int kShareBudget = 100;

const Sighting::Touch* find_touch(const Sighting& sighting, std::int32_t observation) {
  for (const auto& t : sighting.touches) {
    if (t.observation == observation) return &t;
  }
  return nullptr;
}

/// An object that is seen through by this share while its observation fits by less than
/// kMismatchFit is in doubt: it turned, or something else took part of its place. Borders under
/// pose error stay below.
constexpr double kMismatchShare = 0.25;
constexpr double kMismatchFit = 0.75;
/// The same when its own observation covers it from the front; since an unseen part of an object
/// may do that too, the object must be in view almost whole, and fit worse.
constexpr double kCoveredWhole = 0.7;
constexpr double kCoveredFit = 0.5;

bool in_doubt(const Candidate& candidate, const Observations& observations) {
  const Sighting& s = candidate.sighting;
  const ObjectModel& model = candidate.object->model;
  if (s.visible() >= kMinVisible && s.seen_through_share() > kMajority) return true;
  int covered = 0;
  double fit = 0.0;
  const int suspects = s.seen_through + s.occluded;
  if (suspects < kMinVisible || suspects < kMismatchShare * (s.visible() + s.occluded))
    return false;
  for (const auto& touch : s.touches) {
    const Observation& observation = observations.list[touch.observation];
    if (observation.class_id != candidate.object->class_id || touch.hit == 0) continue;
    covered = std::max(covered, touch.in_front);
    fit = std::max(
        fit, model.explained_share(observation.points, static_cast<float>(1.5 * model.spacing_m()),
                                   kShareBudget));
  }
  if (s.visible() >= kMinVisible && s.seen_through_share() > kMismatchShare)
    return fit < kMismatchFit;
  const int seen = s.visible() + covered;
  return fit < kCoveredFit && seen >= kCoveredWhole * s.total &&
         s.seen_through + covered > kMismatchShare * seen;
}

std::shared_ptr<const IcpTarget> target_of(LibraryObject& object, double max_distance_m) {
  if (!object.icp_target) {
    Points points, normals;
    points.reserve(object.model.surfels().size());
    normals.reserve(object.model.surfels().size());
    for (const Surfel& s : object.model.surfels()) {
      points.push_back(s.point_W);
      normals.push_back(s.normal_W);
    }
    const double inlier = 1.5 * object.model.spacing_m();
    object.icp_target =
        std::make_shared<IcpTarget>(points, normals, inlier, std::max(inlier, max_distance_m));
  }
  return object.icp_target;
}

Eigen::Vector3d centroid(const Points& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points) sum += p.cast<double>();
  return sum / static_cast<double>(points.size());
}

Points icp_source(const Observation& observation, const AssociationConfig& config) {
  Points source;
  const std::size_t step = std::max<std::size_t>(1, observation.points.size() / config.icp_points);
  source.reserve(observation.points.size() / step + 1);
  for (std::size_t i = 0; i < observation.points.size(); i += step) {
    source.push_back(observation.points[i].point_W);
  }
  return source;
}

/// The match that an alignment stands for; nothing when too many points lie off the object.
std::optional<Match> match_of(const IcpResult& icp, const Points& source, const Pose& T_W_C,
                              const AssociationConfig& config) {
  if (icp.dissimilarity > config.max_dissimilarity) return std::nullopt;
  double distance = 0.0;
  for (const auto& p : source) {
    const Eigen::Vector3d here = p.cast<double>();
    distance += (here - icp.T_target_source * here).norm();
  }
  const Eigen::Vector3d center = centroid(source);
  const Eigen::Vector3d moved_C =
      T_W_C.linear().transpose() * (center - icp.T_target_source * center);
  Match match;
  match.T_new_old = icp.T_target_source.inverse();
  match.displacement_m = distance / static_cast<double>(source.size());
  // Positive when the observation is nearer to the camera than the object was.
  match.sign = moved_C.z() < 0.0 ? 1 : -1;
  match.cost =
      config.lambda_translation * match.displacement_m +
      config.lambda_rotation * std::abs(Eigen::AngleAxisd(icp.T_target_source.linear()).angle());
  match.stationary = false;
  return match;
}

IcpOptions icp_options(const LibraryObject& object, const AssociationConfig& config) {
  IcpOptions options;
  options.max_iterations = config.icp_iterations;
  options.robust_scale_m = object.model.spacing_m();
  return options;
}

/// Aligns an observation with an object that may be anywhere within the gate.
std::optional<Match> align(LibraryObject& object, const Observation& observation, const Pose& T_W_C,
                           const AssociationConfig& config) {
  const Points source = icp_source(observation, config);
  const auto target = target_of(object, config.icp_max_distance_m);
  const IcpOptions options = icp_options(object, config);
  // Start with the centres on each other where that is within the gate: ICP finds the rest.
  Pose start = Pose::Identity();
  const Eigen::Vector3d offset = object.box.pose.position_W - observation.box.pose.position_W;
  start.translation() = Eigen::Vector3d(offset.x(), offset.y(), 0.0);
  IcpResult best = point_to_plane_icp(*target, source, options, start);
  const IcpResult in_place = point_to_plane_icp(*target, source, options);
  if (in_place.dissimilarity <= best.dissimilarity) best = in_place;
  return match_of(best, source, T_W_C, config);
}

}  // namespace

std::optional<Match> align_in_place(LibraryObject& object, const Observation& observation,
                                    const Pose& T_W_C, const AssociationConfig& config) {
  if (object.model.surfels().empty() || observation.points.empty()) return std::nullopt;
  const Points source = icp_source(observation, config);
  const auto target = target_of(object, config.icp_max_distance_m);
  return match_of(point_to_plane_icp(*target, source, icp_options(object, config)), source, T_W_C,
                  config);
}

AssociationResult associate(const Candidate* candidates, std::size_t count,
                            const Observations& observations, const Pose& T_W_C,
                            const AssociationConfig& config) {
  AssociationResult result;
  std::vector<Match> pairs;
  std::vector<AssignmentCandidate> gated;
  // Best in-place object of each observation, for pieces.
  std::vector<double> best_share(observations.list.size(), 0.0);
  std::vector<std::size_t> best_candidate(observations.list.size(), 0);

  for (std::size_t c = 0; c < count; ++c) {
    LibraryObject& object = *candidates[c].object;
    const Sighting& sighting = candidates[c].sighting;
    const double spacing = object.model.spacing_m();
    const bool doubtful = in_doubt(candidates[c], observations);
    result.doubtful.push_back(doubtful);
    for (std::size_t j = 0; j < observations.list.size(); ++j) {
      const Observation& observation = observations.list[j];
      const double class_cost = observation.class_id == object.class_id ? 0.0 : config.lambda_class;
      if (class_cost > config.cutoff_cost) continue;
      const double distance = (object.box.pose.position_W - observation.box.pose.position_W).norm();
      const bool overlapping = box_overlap(object.box, observation.box, 4.0 * spacing) > 0.0;
      if (distance >= config.max_distance_m && !overlapping) continue;

      Match match;
      match.candidate = c;
      match.observation = static_cast<std::int32_t>(j);
      const Sighting::Touch* touch = find_touch(sighting, match.observation);
      if (!doubtful) {
        const double share =
            overlapping ? object.model.explained_share(
                              observation.points, static_cast<float>(1.5 * spacing), kShareBudget)
                        : 0.0;
        if (share > best_share[j]) best_share[j] = share, best_candidate[j] = c;
        const bool holds_object =
            touch && touch->hit >= kMinVisible && touch->hit > kMajority * sighting.visible();
        const bool explained = touch && touch->hit > 0 && share > kMajority;
        if (holds_object || explained) {
          match.cost = class_cost + 1.0 - share;
          pairs.push_back(match);
          gated.push_back({static_cast<int>(c), static_cast<int>(j), match.cost});
          continue;
        }
      }
      // Only an object whose place is empty, or taken by something right in front, may have moved.
      const bool covered = touch && touch->in_front >= kMinVisible &&
                           touch->in_front > kMajority * (sighting.visible() + sighting.occluded);
      if (!(doubtful || covered) || distance >= config.max_distance_m) continue;
      if (object.model.surfels().empty()) continue;
      const auto aligned = align(object, observation, T_W_C, config);
      if (!aligned) continue;
      match = *aligned;
      match.candidate = c;
      match.observation = static_cast<std::int32_t>(j);
      match.cost += class_cost;
      if (match.cost > config.cutoff_cost) continue;
      pairs.push_back(match);
      gated.push_back({static_cast<int>(c), static_cast<int>(j), match.cost});
    }
  }

  std::vector<bool> taken(observations.list.size(), false);
  for (const auto& [row, col] : assign(gated, config.cutoff_cost)) {
    for (const Match& pair : pairs) {
      if (static_cast<int>(pair.candidate) != row || pair.observation != col) continue;
      result.matches.push_back(pair);
      taken[col] = true;
    }
  }
  std::sort(result.matches.begin(), result.matches.end(),
            [](const Match& a, const Match& b) { return a.candidate < b.candidate; });
  for (std::size_t j = 0; j < observations.list.size(); ++j) {
    if (taken[j]) continue;
    if (config.grow_by_pieces && best_share[j] >= kPieceShare) {
      result.pieces.push_back({static_cast<std::int32_t>(j), best_candidate[j]});
    } else {
      result.unassigned.push_back(static_cast<std::int32_t>(j));
    }
  }
  return result;
}

}  // namespace pocd

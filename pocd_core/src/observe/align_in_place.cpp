#include "pocd/observe/align_in_place.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/registration/point_to_plane_icp.hpp"

namespace pocd {
namespace {

std::shared_ptr<const IcpTarget> target_of(LibraryObject& object, double max_distance_m) {
  if (!object.icp_target) {
    const double inlier = 1.5 * object.model.spacing_m();
    object.icp_target = std::make_shared<IcpTarget>(
        icp_target(object.model.surfels(), inlier, std::max(inlier, max_distance_m)));
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
  return match;
}

IcpOptions icp_options(const LibraryObject& object, const AssociationConfig& config) {
  IcpOptions options;
  options.max_iterations = config.icp_iterations;
  options.robust_scale_m = object.model.spacing_m();
  return options;
}

}  // namespace

IcpTarget icp_target(const std::vector<Surfel>& surfels, double inlier_distance_m,
                     double max_correspondence_m) {
  Points points, normals;
  points.reserve(surfels.size());
  normals.reserve(surfels.size());
  for (const Surfel& s : surfels) {
    points.push_back(s.point_W);
    normals.push_back(s.normal_W);
  }
  return IcpTarget(points, normals, inlier_distance_m, max_correspondence_m);
}

std::optional<Match> align_in_place(LibraryObject& object, const Observation& observation,
                                    const Pose& T_W_C, const Pose& start,
                                    const AssociationConfig& config) {
  if (object.model.surfels().empty() || observation.points.empty()) return std::nullopt;
  const Points source = icp_source(observation, config);
  const auto target = target_of(object, config.icp_max_distance_m);
  return match_of(point_to_plane_icp(*target, source, icp_options(object, config), start), source,
                  T_W_C, config);
}

}  // namespace pocd

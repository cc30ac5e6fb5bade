#include "pocd/change/geometric_change.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/change/ray_traced_change.hpp"

namespace pocd {
namespace {

/// Median over the points that both views hold: the published measure also counts only voxels that
/// are within the truncation of both surfaces. Points that are seen through altogether tell whether
/// the object is there, not how far it moved; only where nothing else is left do all count.
double projective(const Sighting& sighting, double band_m) {
  std::vector<float> values;
  for (const float d : sighting.differences_m) {
    if (std::abs(d) <= band_m) values.push_back(d);
  }
  if (values.empty()) values = sighting.differences_m;
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return -static_cast<double>(*middle);
}

}  // namespace

double geometric_change(const LibraryObject& object, const Observation& observation,
                        const Sighting& sighting, const Match& match, const OrganizedCloud& cloud,
                        const ChangeConfig& config) {
  double delta_m = 0.0;
  if (config.measure == ChangeMeasure::kRayTraced) {
    const Eigen::Isometry3f T_C_W = cloud.T_W_C.inverse().cast<float>();
    Points object_C, observation_C;
    for (const Surfel& s : object.model.surfels()) object_C.push_back(T_C_W * s.point_W);
    for (const SurfacePoint& p : observation.points) observation_C.push_back(T_C_W * p.point_W);
    RayTracedChangeOptions options;
    options.voxel_size_m = object.model.spacing_m();
    options.truncation_m = std::max(config.tsdf_truncation_m, options.voxel_size_m);
    options.lambda_diff = config.lambda_diff;
    const auto change = ray_traced_change(object_C, observation_C, -match.sign, options);
    delta_m = change ? change->delta_m : match.sign * match.displacement_m;
    // In place there is no alignment whose direction gives the sign.
    if (change && match.stationary) delta_m = std::copysign(delta_m, change->mean_signed_m);
  } else {
    delta_m =
        match.stationary ? projective(sighting, config.tau_m) : match.sign * match.displacement_m;
  }
  return std::clamp(delta_m, -config.delta_max_m, config.delta_max_m);
}

}  // namespace pocd

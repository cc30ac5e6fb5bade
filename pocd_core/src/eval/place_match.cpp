#include "pocd/eval/place_match.hpp"

#include <algorithm>

#include "pocd/segmentation/observations.hpp"

namespace pocd {
namespace {

constexpr double kSameShare = 0.5;
constexpr double kLargestFootprint = 4.0;

double volume(const OrientedBox& box, double least_m) {
  return box.size_m.cwiseMax(least_m).prod();
}

double common_volume(const OrientedBox& a, const OrientedBox& b, double least_m) {
  return box_overlap(a, b, least_m) * std::min(volume(a, least_m), volume(b, least_m));
}

OrientedBox grown(const OrientedBox& box, double tolerance_m) {
  OrientedBox out = box;
  out.size_m += Eigen::Vector3d::Constant(2.0 * tolerance_m);
  return out;
}

double footprint(const OrientedBox& box, double least_m) {
  return std::max(box.size_m.x(), least_m) * std::max(box.size_m.y(), least_m);
}

}  // namespace

double share_in_place(const OrientedBox& box, const OrientedBox& truth, double tolerance_m) {
  return std::min(1.0, common_volume(box, grown(truth, tolerance_m), tolerance_m) /
                           std::min(volume(box, tolerance_m), volume(truth, tolerance_m)));
}

bool same_place(const OrientedBox& box, const OrientedBox& truth, double tolerance_m) {
  return footprint(box, tolerance_m) <= kLargestFootprint * footprint(truth, tolerance_m) &&
         share_in_place(box, truth, tolerance_m) >= kSameShare;
}

bool covers(const OrientedBox& box, const OrientedBox& truth, double tolerance_m) {
  return common_volume(grown(box, tolerance_m), truth, tolerance_m) >=
         kSameShare * volume(truth, tolerance_m);
}

double place_fit(const OrientedBox& box, const OrientedBox& truth, double tolerance_m) {
  const double common = common_volume(box, truth, tolerance_m);
  return common / (volume(box, tolerance_m) + volume(truth, tolerance_m) - common);
}

}  // namespace pocd

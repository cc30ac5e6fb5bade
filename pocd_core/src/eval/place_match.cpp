#include "pocd/eval/place_match.hpp"

#include <algorithm>

#include "pocd/segmentation/observations.hpp"

namespace pocd {
namespace {

constexpr double kSameShare = 0.5;
constexpr double kLargestFootprint = 4.0;

double volume(const OrientedBox& box) { return box.size_m.cwiseMax(kMinBoxSize_m).prod(); }

double common_volume(const OrientedBox& a, const OrientedBox& b) {
  return box_overlap(a, b, kMinBoxSize_m) * std::min(volume(a), volume(b));
}

OrientedBox grown(const OrientedBox& box) {
  OrientedBox out = box;
  out.size_m += Eigen::Vector3d::Constant(2.0 * kPlaceTolerance_m);
  return out;
}

double footprint(const OrientedBox& box) {
  return std::max(box.size_m.x(), kMinBoxSize_m) * std::max(box.size_m.y(), kMinBoxSize_m);
}

}  // namespace

double share_in_place(const OrientedBox& box, const OrientedBox& truth) {
  return std::min(1.0, common_volume(box, grown(truth)) / std::min(volume(box), volume(truth)));
}

bool same_place(const OrientedBox& box, const OrientedBox& truth) {
  return footprint(box) <= kLargestFootprint * footprint(truth) &&
         share_in_place(box, truth) >= kSameShare;
}

bool covers(const OrientedBox& box, const OrientedBox& truth) {
  return common_volume(grown(box), truth) >= kSameShare * volume(truth);
}

double place_fit(const OrientedBox& box, const OrientedBox& truth) {
  const double common = common_volume(box, truth);
  return common / (volume(box) + volume(truth) - common);
}

}  // namespace pocd

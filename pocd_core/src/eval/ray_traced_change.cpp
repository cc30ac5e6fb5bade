#include "pocd/eval/ray_traced_change.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// Voxel coordinates are packed in 21 bits each.
constexpr int kCoordinateBits = 21;
constexpr int kCoordinateLimit = 1 << (kCoordinateBits - 1);

std::uint64_t pack(const Eigen::Array3i& voxel) {
  const auto part = [](int x) { return static_cast<std::uint64_t>(x + kCoordinateLimit); };
  return part(voxel.x()) | part(voxel.y()) << kCoordinateBits |
         part(voxel.z()) << (2 * kCoordinateBits);
}

// Mean of the signed distances that rays gave to a voxel.
struct Distance {
  double sum = 0.0;
  int rays = 0;

  double mean() const { return sum / rays; }
};

struct Voxel {
  std::uint64_t key;
  Distance object;
  Distance observation;
};

// The voxels of the object's band in the order in which rays reached them, found by a hash table
// with linear probing.
class Band {
 public:
  explicit Band(std::size_t expected) {
    std::size_t slots = 64;
    while (slots < 2 * expected) slots *= 2;
    slots_.assign(slots, kEmpty);
  }

  Voxel& insert(std::uint64_t key) {
    if (2 * (voxels_.size() + 1) > slots_.size()) grow();
    std::uint32_t& slot = slot_of(key);
    if (slot == kEmpty) {
      slot = static_cast<std::uint32_t>(voxels_.size());
      voxels_.push_back({key, {}, {}});
    }
    return voxels_[slot];
  }

  Voxel* find(std::uint64_t key) {
    const std::uint32_t slot = slot_of(key);
    return slot == kEmpty ? nullptr : &voxels_[slot];
  }

  const std::vector<Voxel>& voxels() const { return voxels_; }

 private:
  static constexpr std::uint32_t kEmpty = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t& slot_of(std::uint64_t key) {
    // Fibonacci hashing (Knuth, volume 3, section 6.4); the high bits are the mixed ones.
    std::size_t i = (key * 0x9E3779B97F4A7C15ull) >> 32 & (slots_.size() - 1);
    while (slots_[i] != kEmpty && voxels_[slots_[i]].key != key) i = (i + 1) & (slots_.size() - 1);
    return slots_[i];
  }

  void grow() {
    slots_.assign(2 * slots_.size(), kEmpty);
    for (std::uint32_t i = 0; i < voxels_.size(); ++i) slot_of(voxels_[i].key) = i;
  }

  std::vector<std::uint32_t> slots_;
  std::vector<Voxel> voxels_;
};

// Calls visit(key, signed distance) for the voxels in which the ray of `point` is within the
// truncation of it (Amanatides and Woo, Eurographics 1987).
template <class Visit>
void trace(const Eigen::Vector3f& point_C, const RayTracedChangeOptions& options, Visit&& visit) {
  const Eigen::Vector3d point = point_C.cast<double>();
  POCD_CHECK(point.allFinite());
  const double range = point.norm();
  if (range < 1e-6) return;
  const Eigen::Array3d direction = (point / range).array();
  const double begin = std::max(0.0, range - options.truncation_m);
  const double end = range + options.truncation_m;
  const double size = options.voxel_size_m;

  const Eigen::Array3d first = (begin * direction / size).floor();
  POCD_CHECK((first.abs() < kCoordinateLimit - 2 - 2 * end / size).all());
  Eigen::Array3i voxel = first.cast<int>();
  Eigen::Array3i step;
  Eigen::Array3d next, per_voxel;  // ray parameter [m] of the next face, and between faces
  for (int i = 0; i < 3; ++i) {
    step[i] = direction[i] > 0.0 ? 1 : -1;
    const bool parallel = direction[i] == 0.0;
    const double infinity = std::numeric_limits<double>::infinity();
    per_voxel[i] = parallel ? infinity : size / std::abs(direction[i]);
    next[i] = parallel ? infinity : (voxel[i] + (step[i] > 0)) * size / direction[i];
  }
  for (double at = begin; at < end;) {
    const double centre = size * ((voxel.cast<double>() + 0.5) * direction).sum();
    const double distance = range - centre;
    if (std::abs(distance) <= options.truncation_m) visit(pack(voxel), distance);
    int axis;
    at = next.minCoeff(&axis);
    next[axis] += per_voxel[axis];
    voxel[axis] += step[axis];
  }
}

void add(double distance, Distance& mean) {
  mean.sum += distance;
  ++mean.rays;
}

}  // namespace

std::optional<RayTracedChange> ray_traced_change(const Points& object_C,
                                                 const Points& observation_C,
                                                 double icp_translation_z_C_m,
                                                 const RayTracedChangeOptions& options) {
  POCD_CHECK(options.voxel_size_m > 0.0 && options.truncation_m >= options.voxel_size_m);
  POCD_CHECK(options.lambda_diff >= 0.0 && std::isfinite(icp_translation_z_C_m));

  Band band(4 * object_C.size());
  for (const auto& p : object_C) {
    trace(p, options, [&](std::uint64_t key, double d) { add(d, band.insert(key).object); });
  }
  for (const auto& p : observation_C) {
    trace(p, options, [&](std::uint64_t key, double d) {
      if (Voxel* voxel = band.find(key)) add(d, voxel->observation);
    });
  }

  RayTracedChange change;
  double sum = 0.0, signed_sum = 0.0;
  for (const Voxel& v : band.voxels()) {
    if (v.observation.rays == 0) continue;
    const double difference = v.object.mean() - v.observation.mean();
    sum += std::abs(difference);
    signed_sum += difference;
    ++change.voxels;
  }
  if (change.voxels == 0) return std::nullopt;
  const double count = static_cast<double>(change.voxels);
  const double sign = icp_translation_z_C_m < 0.0 ? 1.0 : -1.0;
  change.delta_m = options.lambda_diff * sign * sum / count;
  change.mean_signed_m = signed_sum / count;
  return change;
}

}  // namespace pocd

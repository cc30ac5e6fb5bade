#include "pocd/segmentation/observations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "clusters.hpp"
#include "pocd/common/cell_index.hpp"
#include "thing_pieces.hpp"

namespace pocd {
namespace {

/// Memory of this file, kept from frame to frame so that none is asked for per point.
struct Memory {
  struct CellSum {
    Eigen::Vector3f point, normal;
    float sigma = 0.0f;
    int count = 0;
  };
  ClusterMemory clusters;
  std::vector<std::uint32_t> column_steps;  // per column: bit n where n divides it
  CellIndex cells;
  std::vector<CellSum> sums;
  Points box_points, box_normals;
};

/// Box of about 500 of the cluster's points, evenly by pixel index.
OrientedBox sample_box(const OrganizedCloud& cloud, const PlaneSegmentation& planes,
                       const std::vector<std::int32_t>& members, Memory& memory) {
  Points &points = memory.box_points, &normals = memory.box_normals;
  points.clear();
  normals.clear();
  const std::size_t step = std::max<std::size_t>(1, members.size() / 500);
  for (std::size_t k = 0; k < members.size(); k += step) {
    const std::int32_t i = members[k];
    points.push_back(cloud.point_W(i));
    const std::uint16_t plane = planes.plane_of[i];
    const bool known = plane != PlaneSegmentation::kNoPlane;
    normals.push_back(known ? planes.planes[plane].normal_W : Eigen::Vector3f::Zero().eval());
  }
  return fit_box(points, normals, 0.01);
}

/// Boxes that overlap by a good share are one thing seen in pieces, with the larger one's class. As
/// published, any overlap is enough: see merge_overlapping_observations().
void merge_overlapping(const OrganizedCloud& cloud, const PlaneSegmentation& planes,
                       double min_size_m, std::vector<Cluster>& clusters, Memory& memory) {
  constexpr double kSameClass = 0.3, kOtherClass = 0.8;
  for (Cluster& c : clusters) c.box = sample_box(cloud, planes, c.members, memory);
  bool merged = true;
  while (merged) {
    merged = false;
    for (std::size_t a = 0; a < clusters.size() && !merged; ++a) {
      for (std::size_t b = a + 1; b < clusters.size() && !merged; ++b) {
        Cluster& large = clusters[a].pixels >= clusters[b].pixels ? clusters[a] : clusters[b];
        Cluster& small = &large == &clusters[a] ? clusters[b] : clusters[a];
        if (large.instance != small.instance) continue;
        const bool same = large.class_id == small.class_id;
        if (!same && small.pixels * 4 > large.pixels) continue;
        // What has one instance number is one thing, whatever stands before it.
        const bool one_thing = same && large.instance != 0;
        if (!one_thing &&
            box_overlap(large.box, small.box, min_size_m) < (same ? kSameClass : kOtherClass))
          continue;
        large.members.insert(large.members.end(), small.members.begin(), small.members.end());
        large.pixels += small.pixels;
        large.area_m2 += small.area_m2;
        large.pieced |= small.pieced;
        large.box = sample_box(cloud, planes, large.members, memory);
        memory.clusters.members.push_back(std::move(small.members));
        clusters.erase(clusters.begin() + (&small - clusters.data()));
        merged = true;
      }
    }
  }
}

/// Whether two clusters may be pieces of one thing, by class and instance.
bool any_alike(const std::vector<Cluster>& clusters) {
  std::set<ClassId> seen;
  return std::any_of(clusters.begin(), clusters.end(), [&](const Cluster& c) {
    return c.instance == 0 && !seen.insert(c.class_id).second;
  });
}

/// Makes one cluster of the pieces of a thing. What is one has an instance of its own from then on.
void join_pieces(const OrganizedCloud& cloud, const SegmentationConfig& config,
                 const DepthNoise& noise, double spacing_m, const PlaneSegmentation& planes,
                 std::vector<Cluster>& clusters, Memory& memory) {
  const auto first_of = find_pieces(cloud, config, noise, spacing_m, planes, clusters);
  for (std::size_t k = clusters.size(); k-- > 0;) {
    if (first_of[k] == k) continue;
    Cluster& whole = clusters[first_of[k]];
    whole.members.insert(whole.members.end(), clusters[k].members.begin(),
                         clusters[k].members.end());
    whole.pixels += clusters[k].pixels;
    whole.area_m2 += clusters[k].area_m2;
    whole.pieced = true;
    memory.clusters.members.push_back(std::move(clusters[k].members));
    clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(k));
  }
  for (Cluster& cluster : clusters) {
    if (cluster.pieced) std::sort(cluster.members.begin(), cluster.members.end());
  }
}

/// Bit n (up to 31) where n divides `number`.
std::uint32_t divisors(std::int32_t number) {
  std::uint32_t bits = 0;
  for (std::int32_t n = 1; n < 32; ++n) bits |= number % n == 0 ? 1u << n : 0u;
  return bits;
}

/// Whether a pixel is on the grid of every step-th row and column, without a division per pixel
/// when they come row by row.
class PixelGrid {
 public:
  PixelGrid(int width, std::vector<std::uint32_t>& column_steps)
      : width_(width), column_steps_(column_steps) {
    if (column_steps_.size() == static_cast<std::size_t>(width)) return;
    column_steps_.clear();
    for (int col = 0; col < width; ++col) column_steps_.push_back(divisors(col));
  }
  bool has(std::int32_t i, int step) {
    if (i < row_begin_ || i >= row_begin_ + width_) {
      row_ = i / width_;
      row_begin_ = row_ * width_;
      row_steps_ = divisors(row_);
    }
    const std::int32_t col = i - row_begin_;
    if (step < 32) return (row_steps_ & column_steps_[col]) >> step & 1u;
    return col % step == 0 && row_ % step == 0;
  }

 private:
  const std::int32_t width_;
  std::vector<std::uint32_t>& column_steps_;
  std::int32_t row_ = -1, row_begin_ = std::numeric_limits<std::int32_t>::max();
  std::uint32_t row_steps_ = 0;
};

/// Thins a cluster: averages the points of each cell of a grid. Only about four pixels per cell and
/// axis are looked at, however near the surface is.
void thin(const OrganizedCloud& cloud, const PlaneSegmentation& planes, const DepthNoise& noise,
          double spacing_m, const Cluster& cluster, Memory& memory,
          std::vector<SurfacePoint>& points) {
  std::vector<Memory::CellSum>& sums = memory.sums;
  memory.cells.clear();
  sums.clear();
  const float inverse = static_cast<float>(1.0 / spacing_m);
  const double pixels_per_spacing = spacing_m * cloud.camera.fx;
  const Eigen::Vector3f eye_W = cloud.T_W_C.translation().cast<float>();
  // Neighbours mostly fall into one cell.
  std::uint64_t last_key = 0;
  std::int32_t last = CellIndex::kNone;
  PixelGrid grid(cloud.width, memory.column_steps);
  const auto take = [&](std::int32_t i) {
    const Eigen::Vector3f p = cloud.point_W(i);
    const std::uint64_t key = cell_key(p, inverse);
    if (last == CellIndex::kNone || key != last_key) {
      last = memory.cells.insert(key, static_cast<std::int32_t>(sums.size()));
      last_key = key;
      if (static_cast<std::size_t>(last) == sums.size())
        sums.push_back({Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), 0.0f, 0});
    }
    Memory::CellSum& sum = sums[last];
    sum.point += p;
    const std::uint16_t plane = planes.plane_of[i];
    if (plane != PlaneSegmentation::kNoPlane) sum.normal += planes.planes[plane].normal_W;
    sum.sigma += static_cast<float>(noise.sigma(cloud.depth_m[i]));
    ++sum.count;
  };
  for (const std::int32_t i : cluster.members) {
    const double pixels = pixels_per_spacing / cloud.depth_m[i];  // depth may be next to nothing
    const int step = std::max(1, static_cast<int>(std::min(pixels / 4.0, 1e6)));
    if (grid.has(i, step)) take(i);
  }
  // A mask of stripes may have no pixel on that grid.
  if (sums.empty()) std::for_each(cluster.members.begin(), cluster.members.end(), take);
  points.clear();
  points.reserve(sums.size());
  for (const Memory::CellSum& sum : sums) {
    const float count = static_cast<float>(sum.count);
    SurfacePoint point;
    point.point_W = sum.point / count;
    point.normal_W = Eigen::Vector3f::Zero();
    point.sigma_m = sum.sigma / count;
    const float norm = sum.normal.norm();
    // Several planes in one cell (an edge) leave a short sum: no single normal there.
    if (norm > 0.7f * count) point.normal_W = sum.normal / norm;
    if (point.normal_W.dot(eye_W - point.point_W) < 0.0f) point.normal_W = -point.normal_W;
    points.push_back(point);
  }
}

/// Hands pixels of the ground band that carry the class of the observation above them to it.
void claim_foot(const OrganizedCloud& cloud, const SegmentationConfig& config,
                const DepthNoise& noise, Observations& out) {
  const float tolerance = static_cast<float>(config.cluster_tolerance_m);
  const float pixel_angle = static_cast<float>(1.0 / cloud.camera.fy);
  for (int row = 1; row < cloud.height; ++row) {
    for (int col = 0; col < cloud.width; ++col) {
      const std::size_t i = static_cast<std::size_t>(row) * cloud.width + col;
      const std::size_t above = i - cloud.width;
      const std::int32_t owner = out.observation_of[above];
      if (owner == Observations::kNone || out.observation_of[i] != Observations::kNone ||
          cloud.kind[i] != PixelKind::kGround || cloud.label[i] != out.list[owner].class_id) {
        continue;
      }
      // The class says whose it is; depth must go on from the row above.
      const float z = cloud.depth_m[i];
      const float limit =
          0.5f * tolerance + 2.0f * pixel_angle * z + 2.0f * static_cast<float>(noise.sigma(z));
      if (std::abs(z - cloud.depth_m[above]) < limit) out.observation_of[i] = owner;
    }
  }
}

/// Of the observations that are things told by geometry: whether one is mostly one plane, as a
/// piece of a wall is.
std::vector<bool> find_flat(const PlaneSegmentation& planes, const Observations& observations) {
  constexpr double kFlatShare = 0.5;
  std::vector<std::map<std::uint16_t, int>> counts(observations.list.size());
  std::vector<bool> flat(observations.list.size(), false);
  for (std::size_t i = 0; i < observations.observation_of.size(); ++i) {
    const std::int32_t owner = observations.observation_of[i];
    if (owner == Observations::kNone || planes.plane_of[i] == PlaneSegmentation::kNoPlane) continue;
    const auto k = static_cast<std::size_t>(owner);
    if (observations.list[k].class_id == kThing) ++counts[k][planes.plane_of[i]];
  }
  for (std::size_t k = 0; k < flat.size(); ++k) {
    for (const auto& [plane, count] : counts[k])
      flat[k] = flat[k] || count > kFlatShare * observations.list[k].pixels;
  }
  return flat;
}

/// Outlines of the observations: where each is cut off.
void find_cuts(const OrganizedCloud& cloud, const SegmentationConfig& config,
               const DepthNoise& noise, double spacing_m, const PlaneSegmentation& planes,
               Observations& out) {
  struct Outline {
    int length = 0, cut = 0;
    int at_limit = 0;  ///< of the cuts, by the depth limit
    int hidden = 0;    ///< of the cuts, by something nearer
    int ended = 0;     ///< of things: what lies behind is seen, and does not go on in its plane
  };
  std::vector<Outline> sides(out.list.size()), tops(out.list.size());
  const auto look = [&](std::int32_t i, std::int32_t j, std::vector<Outline>& outlines) {
    const std::int32_t owner = out.observation_of[i];
    if (j >= 0 && out.observation_of[j] == owner) return;
    Outline& outline = outlines[owner];
    ++outline.length;
    if (j < 0) {
      ++outline.cut;
      return;
    }
    const float z = cloud.depth_m[i], next = cloud.depth_m[j];
    const float step = static_cast<float>(spacing_m + 3.0 * noise.sigma(z));
    if (next <= 0.0f) {
      --outline.length;  // a hole tells nothing
    } else if (next < z - step) {
      ++outline.cut;
      ++outline.hidden;
    } else if (cloud.kind[j] == PixelKind::kNone && next < z + step) {
      ++outline.cut;
      ++outline.at_limit;
    }
    if (cloud.label[i] != kThing || !(next > z + step)) return;
    // A wall that is seen along goes on from pixel to pixel with steps like these.
    const std::uint16_t plane = planes.plane_of[i];
    const bool goes_on =
        plane != PlaneSegmentation::kNoPlane &&
        std::abs(planes.planes[plane].normal_W.dot(cloud.point_W(static_cast<std::size_t>(j))) -
                 planes.planes[plane].offset_m) <
            config.plane_tolerance_m + 3.0 * noise.sigma(next);
    outline.ended += !goes_on;
  };
  for (std::int32_t row = 0; row < cloud.height; ++row) {
    for (std::int32_t col = 0; col < cloud.width; ++col) {
      const std::int32_t i = row * cloud.width + col;
      if (out.observation_of[i] == Observations::kNone) continue;
      look(i, col > 0 ? i - 1 : -1, sides);
      look(i, col + 1 < cloud.width ? i + 1 : -1, sides);
      look(i, row > 0 ? i - cloud.width : -1, tops);
    }
  }
  const std::vector<bool> flat = find_flat(planes, out);
  for (std::size_t k = 0; k < out.list.size(); ++k) {
    const Outline &side = sides[k], &top = tops[k];
    const int length = side.length + top.length;
    if (length > 0) out.list[k].cut_share = static_cast<double>(side.cut + top.cut) / length;
    if (side.length > 0 && out.list[k].class_id == kThing) {
      // What stands before a thing hides its end; before a wall it tells nothing.
      const int ended = side.ended + (flat[k] ? 0 : side.hidden);
      out.list[k].free_beside_share = static_cast<double>(ended) / side.length;
    }
    // What goes on beyond the depth limit goes on at the same height.
    if (top.length > 0)
      out.list[k].cut_above_share = static_cast<double>(top.cut - top.at_limit) / top.length;
  }
}

}  // namespace

void extract_observations(const SegmentationConfig& config, const DepthNoise& noise,
                          double spacing_m, const PlaneSegmentation& planes, OrganizedCloud& cloud,
                          Observations& out) {
  static thread_local Memory memory;
  std::vector<Cluster> clusters = find_clusters(cloud, config, noise, memory.clusters);
  merge_overlapping(cloud, planes, 2.0 * spacing_m, clusters, memory);
  if (any_alike(clusters)) {
    join_pieces(cloud, config, noise, spacing_m, planes, clusters, memory);
    merge_overlapping(cloud, planes, 2.0 * spacing_m, clusters, memory);
  }
  out.list.clear();
  out.observation_of.assign(cloud.size(), Observations::kNone);
  for (Cluster& cluster : clusters) {
    Observation observation;
    observation.class_id = cluster.class_id;
    observation.instance =
        cluster.pieced ? static_cast<std::uint16_t>(out.list.size() + 1) : cluster.instance;
    observation.pixels = cluster.pixels;
    observation.area_m2 = cluster.area_m2;
    thin(cloud, planes, noise, spacing_m, cluster, memory, observation.points);
    memory.box_points.clear();
    memory.box_normals.clear();
    for (const SurfacePoint& p : observation.points) {
      memory.box_points.push_back(p.point_W);
      memory.box_normals.push_back(p.normal_W);
    }
    observation.box = fit_box(memory.box_points, memory.box_normals, 0.01);
    const auto index = static_cast<std::int32_t>(out.list.size());
    for (const std::int32_t i : cluster.members) {
      out.observation_of[i] = index;
      cloud.label[i] = cluster.class_id;
    }
    out.list.push_back(std::move(observation));
    memory.clusters.members.push_back(std::move(cluster.members));
  }
  claim_foot(cloud, config, noise, out);
  find_cuts(cloud, config, noise, spacing_m, planes, out);
}

}  // namespace pocd

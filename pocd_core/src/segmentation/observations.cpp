#include "pocd/segmentation/observations.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace pocd {
namespace {

/// Union-find over pixels with path halving; the root is the smallest index, so labels do not
/// depend on the order of joins.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  std::int32_t root(std::int32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = root(a), b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::int32_t> parent_;
};

struct Cluster {
  std::int32_t root = 0;
  ClassId class_id = 0;
  std::uint16_t instance = 0;
  int pixels = 0;
  double area_m2 = 0.0;
  std::vector<std::int32_t> members;
  OrientedBox box;
};

/// Whether object pixel b belongs with object pixel a, whose largest distance to neighbours is
/// given.
bool connected(const OrganizedCloud& cloud, std::int32_t a, std::int32_t b, float limit_m) {
  if (cloud.kind[b] != PixelKind::kObject || cloud.label[a] != cloud.label[b] ||
      cloud.instance[a] != cloud.instance[b]) {
    return false;
  }
  const float dx = cloud.x_W[a] - cloud.x_W[b], dy = cloud.y_W[a] - cloud.y_W[b],
              dz = cloud.z_W[a] - cloud.z_W[b];
  return dx * dx + dy * dy + dz * dz < limit_m * limit_m;
}

/// Connected components of object pixels, in the order of their first pixel.
std::vector<Cluster> find_clusters(const OrganizedCloud& cloud, const SegmentationConfig& config,
                                   const DepthNoise& noise) {
  const int width = cloud.width, height = cloud.height;
  DisjointSets sets(cloud.size());
  const float tolerance = static_cast<float>(config.cluster_tolerance_m);
  const float pixel_angle = static_cast<float>(1.0 / cloud.camera.fx);
  for (int row = 0; row < height; ++row) {
    for (int col = 0; col < width; ++col) {
      const std::int32_t i = row * width + col;
      if (cloud.kind[i] != PixelKind::kObject) continue;
      const float z = cloud.depth_m[i];
      const float limit =
          tolerance + 2.0f * pixel_angle * z + 2.0f * static_cast<float>(noise.sigma(z));
      const auto try_join = [&](std::int32_t j) {
        const bool joined = connected(cloud, i, j, limit);
        if (joined) sets.join(i, j);
        return joined;
      };
      if (col + 1 < width && !try_join(i + 1) && col + 2 < width) try_join(i + 2);
      if (row + 1 < height && !try_join(i + width) && row + 2 < height) try_join(i + 2 * width);
    }
  }
  std::vector<Cluster> clusters;
  std::vector<std::int32_t> index_of_root(cloud.size(), -1);
  const double pixel_area = 1.0 / (cloud.camera.fx * cloud.camera.fy);
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(cloud.size()); ++i) {
    if (cloud.kind[i] != PixelKind::kObject) continue;
    const std::int32_t root = sets.root(i);
    if (index_of_root[root] < 0) {
      index_of_root[root] = static_cast<std::int32_t>(clusters.size());
      clusters.push_back({});
      clusters.back().root = root;
      clusters.back().class_id = cloud.label[i];
      clusters.back().instance = cloud.instance[i];
    }
    Cluster& cluster = clusters[index_of_root[root]];
    ++cluster.pixels;
    const double z = cloud.depth_m[i];
    cluster.area_m2 += z * z * pixel_area;
    cluster.members.push_back(i);
  }
  clusters.erase(std::remove_if(clusters.begin(), clusters.end(),
                                [&](const Cluster& c) {
                                  return c.pixels < config.min_cluster_pixels ||
                                         c.area_m2 < config.min_cluster_area_m2;
                                }),
                 clusters.end());
  return clusters;
}

/// Box of about 500 of the cluster's points, evenly by pixel index.
OrientedBox sample_box(const OrganizedCloud& cloud, const PlaneSegmentation& planes,
                       const std::vector<std::int32_t>& members) {
  Points points, normals;
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

/// The published rule: overlapping cuboids are one thing seen in pieces. The larger one's class
/// wins.
void merge_overlapping(const OrganizedCloud& cloud, const PlaneSegmentation& planes,
                       double min_size_m, std::vector<Cluster>& clusters) {
  constexpr double kSameClass = 0.3, kOtherClass = 0.8;
  for (Cluster& c : clusters) c.box = sample_box(cloud, planes, c.members);
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
        if (box_overlap(large.box, small.box, min_size_m) < (same ? kSameClass : kOtherClass))
          continue;
        large.members.insert(large.members.end(), small.members.begin(), small.members.end());
        large.pixels += small.pixels;
        large.area_m2 += small.area_m2;
        large.box = sample_box(cloud, planes, large.members);
        clusters.erase(clusters.begin() + (&small - clusters.data()));
        merged = true;
      }
    }
  }
}

/// Thins a cluster: averages the points of each cell of a grid. Only about four pixels per cell and
/// axis are looked at, however near the surface is.
std::vector<SurfacePoint> thin(const OrganizedCloud& cloud, const PlaneSegmentation& planes,
                               const DepthNoise& noise, double spacing_m, const Cluster& cluster) {
  struct Sum {
    Eigen::Vector3f point, normal;
    float sigma;
    int count;
  };
  std::unordered_map<std::uint64_t, std::size_t> slot_of;
  std::vector<Sum> sums;
  const float inverse = static_cast<float>(1.0 / spacing_m);
  const double pixels_per_spacing = spacing_m * cloud.camera.fx;
  const Eigen::Vector3f eye_W = cloud.T_W_C.translation().cast<float>();
  for (const std::int32_t i : cluster.members) {
    const float z = cloud.depth_m[i];
    const int step = std::max(1, static_cast<int>(pixels_per_spacing / z / 4.0));
    if (step > 1 && ((i % cloud.width) % step != 0 || (i / cloud.width) % step != 0)) continue;
    const Eigen::Vector3f p = cloud.point_W(i);
    const auto cell = [&](float v) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v * inverse)) +
                                        (1 << 20)) &
             0x1FFFFF;
    };
    const std::uint64_t key = cell(p.x()) | cell(p.y()) << 21 | cell(p.z()) << 42;
    const auto [it, fresh] = slot_of.try_emplace(key, sums.size());
    if (fresh) sums.push_back({Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), 0.0f, 0});
    Sum& sum = sums[it->second];
    sum.point += p;
    const std::uint16_t plane = planes.plane_of[i];
    if (plane != PlaneSegmentation::kNoPlane) sum.normal += planes.planes[plane].normal_W;
    sum.sigma += static_cast<float>(noise.sigma(z));
    ++sum.count;
  }
  std::vector<SurfacePoint> points;
  points.reserve(sums.size());
  for (const Sum& sum : sums) {
    const float count = static_cast<float>(sum.count);
    SurfacePoint point{sum.point / count, Eigen::Vector3f::Zero(), sum.sigma / count};
    const float norm = sum.normal.norm();
    // Several planes in one cell (an edge) leave a short sum: no single normal there.
    if (norm > 0.7f * count) point.normal_W = sum.normal / norm;
    if (point.normal_W.dot(eye_W - point.point_W) < 0.0f) point.normal_W = -point.normal_W;
    points.push_back(point);
  }
  return points;
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

}  // namespace

void extract_observations(const SegmentationConfig& config, const DepthNoise& noise,
                          double spacing_m, const PlaneSegmentation& planes, OrganizedCloud& cloud,
                          Observations& out) {
  std::vector<Cluster> clusters = find_clusters(cloud, config, noise);
  merge_overlapping(cloud, planes, 2.0 * spacing_m, clusters);
  out.list.clear();
  out.observation_of.assign(cloud.size(), Observations::kNone);
  for (const Cluster& cluster : clusters) {
    Observation observation;
    observation.class_id = cluster.class_id;
    observation.pixels = cluster.pixels;
    observation.area_m2 = cluster.area_m2;
    observation.points = thin(cloud, planes, noise, spacing_m, cluster);
    Points points, normals;
    for (const SurfacePoint& p : observation.points) {
      points.push_back(p.point_W);
      normals.push_back(p.normal_W);
    }
    observation.box = fit_box(points, normals, 0.01);
    const auto index = static_cast<std::int32_t>(out.list.size());
    for (const std::int32_t i : cluster.members) {
      out.observation_of[i] = index;
      cloud.label[i] = cluster.class_id;
    }
    out.list.push_back(std::move(observation));
  }
  claim_foot(cloud, config, noise, out);
}

}  // namespace pocd

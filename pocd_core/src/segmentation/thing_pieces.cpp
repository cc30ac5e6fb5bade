#include "thing_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

namespace pocd {
namespace {

constexpr std::int32_t kNone = -1;
/// Fewer rows or columns are chance.
constexpr int kLeastLines = 3;
/// No container is deeper than this multiple of its width.
constexpr float kDeepest = 1.5f;
/// A plane is looked for so many pixels away from an edge: mixed returns lie on none.
constexpr int kEdgePixels = 4;
/// Normals of a top differ from up by less than 45 degrees.
constexpr float kTopCos = 0.7f;

/// A line of the image, row or column.
struct Line {
  std::int32_t first, step, count;
  std::int32_t at(std::int32_t k) const { return first + k * step; }
};

class Pieces {
 public:
  Pieces(const OrganizedCloud& cloud, const SegmentationConfig& config, const DepthNoise& noise,
         double spacing_m, const PlaneSegmentation& planes, const std::vector<Cluster>& clusters)
      : cloud_(cloud),
        config_(config),
        noise_(noise),
        spacing_m_(spacing_m),
        planes_(planes),
        clusters_(clusters),
        cluster_of_(cloud.size(), kNone) {
    for (std::size_t k = 0; k < clusters.size(); ++k) {
      if (clusters[k].instance != 0) continue;
      for (const std::int32_t i : clusters[k].members)
        cluster_of_[i] = static_cast<std::int32_t>(k);
    }
  }

  std::vector<std::size_t> find() {
    std::vector<std::size_t> parent(clusters_.size());
    std::iota(parent.begin(), parent.end(), std::size_t{0});
    const auto root = [&](std::size_t k) {
      while (parent[k] != k) k = parent[k];
      return k;
    };
    const auto join = [&](const Pair& pair) {
      const std::size_t a = root(pair.first), b = root(pair.second);
      parent[std::max(a, b)] = std::min(a, b);
    };
    for (const bool rows : {true, false}) {
      extents_.assign(clusters_.size(), 0);
      bridges_.clear();
      breaks_.clear();
      edges_.clear();
      const std::int32_t lines = rows ? cloud_.height : cloud_.width;
      for (std::int32_t n = 0; n < lines; ++n) {
        // Columns go up, from the near piece to what is seen over it.
        walk(rows ? Line{n * cloud_.width, 1, cloud_.width}
                  : Line{n + (cloud_.height - 1) * cloud_.width, -cloud_.width, cloud_.height},
             !rows);
      }
      for (const auto& [pair, count] : bridges_) {
        const int smaller = std::min(extents_[pair.first], extents_[pair.second]);
        if (count >= kLeastLines && count >= config_.things.behind_share * smaller &&
            count > 2 * breaks_[pair])
          join(pair);
      }
      // From near to far: the far wall of a container is not the near wall of the next one.
      std::vector<Pair> rims;
      for (const auto& [pair, count] : edges_) {
        const int larger = std::max(extents_[pair.first], extents_[pair.second]);
        if (count >= config_.things.rim_share * larger && same_height(pair)) rims.push_back(pair);
      }
      std::stable_sort(rims.begin(), rims.end(), [&](const Pair& a, const Pair& b) {
        return distance_of(a.first) < distance_of(b.first);
      });
      std::set<std::size_t> far_walls;
      for (const Pair& rim : rims) {
        if (far_walls.count(rim.first) > 0) continue;
        far_walls.insert(rim.second);
        join(rim);
      }
    }
    for (std::size_t k = 0; k < parent.size(); ++k) parent[k] = root(k);
    return parent;
  }

 private:
  using Pair = std::pair<std::size_t, std::size_t>;

  float reach_at(float depth_m) const {
    return static_cast<float>(config_.plane_tolerance_m + 3.0 * noise_.sigma(depth_m));
  }
  float step_at(float depth_m) const {
    return static_cast<float>(spacing_m_ + 3.0 * noise_.sigma(depth_m));
  }

  /// Counts the clusters on the line, those of which one goes on behind something, and those of
  /// which one is seen over the edge of the other.
  void walk(const Line& line, bool upwards) {
    counted_.clear();
    for (std::int32_t k = 0; k < line.count; ++k) {
      const std::int32_t owner = cluster_of_[line.at(k)];
      if (owner == kNone) continue;
      if (std::find(counted_.begin(), counted_.end(), owner) == counted_.end()) {
        counted_.push_back(owner);
        ++extents_[static_cast<std::size_t>(owner)];
      }
      if (k + 1 == line.count || cluster_of_[line.at(k + 1)] == owner) continue;
      look_behind(line, k);
      if (upwards) look_over(line, k);
    }
  }

  /// Follows the plane that ends at place k of the line behind what hides it.
  void look_behind(const Line& line, std::int32_t k) {
    const std::int32_t i = line.at(k);
    const Plane* plane = plane_near(line, k, -1);
    if (plane == nullptr) return;
    const Eigen::Vector3f eye_W = cloud_.T_W_C.translation().cast<float>();
    bool hidden = false;
    for (std::int32_t n = k + 1; n < line.count; ++n) {
      const std::int32_t j = line.at(n);
      const float z = cloud_.depth_m[j];
      if (!(z > 0.0f)) continue;
      const Eigen::Vector3f p_W = cloud_.point_W(static_cast<std::size_t>(j));
      const float along = plane->normal_W.dot(p_W - eye_W) / z;  // per depth
      const float expected = (plane->offset_m - plane->normal_W.dot(eye_W)) / along;
      if (!(along < 0.0f)) return;
      if (std::abs(plane->normal_W.dot(p_W) - plane->offset_m) < reach_at(z)) {
        const std::int32_t other = cluster_of_[j];
        if (hidden && other != kNone && other != cluster_of_[i] && alike(i, j)) {
          ++(goes_on(line, k, n, *plane) ? bridges_ : breaks_)[pair_of(i, j)];
        }
        return;
      }
      if (z > expected - step_at(z)) return;
      hidden = true;
    }
  }

  bool goes_on(const Line& line, std::int32_t a, std::int32_t b, const Plane& plane) const {
    const Plane* other = plane_near(line, b, 1);
    if (other == nullptr) return false;
    const auto i = static_cast<std::size_t>(line.at(a));
    const auto cosine = static_cast<float>(std::cos(config_.plane_max_angle_deg * M_PI / 180.0));
    return plane.normal_W.dot(other->normal_W) > cosine &&
           std::abs(other->normal_W.dot(cloud_.point_W(i)) - other->offset_m) <
               reach_at(cloud_.depth_m[i]);
  }

  void look_over(const Line& column, std::int32_t k) {
    const std::int32_t i = column.at(k);
    int others = 0;
    for (std::int32_t n = k + 1; n < column.count; ++n) {
      const std::int32_t j = column.at(n);
      const float z = cloud_.depth_m[j];
      if (cluster_of_[j] == kNone) {
        // Of a wide container the bottom is seen, too, which is taken for ground.
        const bool bottom = cloud_.kind[j] == PixelKind::kGround && z > cloud_.depth_m[i];
        if (z > 0.0f && !bottom && ++others >= kEdgePixels) return;
        continue;
      }
      const float away = (cloud_.point_W(static_cast<std::size_t>(i)) -
                          cloud_.point_W(static_cast<std::size_t>(j)))
                             .head<2>()
                             .norm();
      if (cluster_of_[j] != cluster_of_[i] && alike(i, j) && z > cloud_.depth_m[i] + step_at(z) &&
          away < depth_of(i) && !has_top(column, k)) {
        ++edges_[{static_cast<std::size_t>(cluster_of_[i]),
                  static_cast<std::size_t>(cluster_of_[j])}];
      }
      return;
    }
  }

  bool alike(std::int32_t i, std::int32_t j) const {
    return clusters_[static_cast<std::size_t>(cluster_of_[i])].class_id ==
           clusters_[static_cast<std::size_t>(cluster_of_[j])].class_id;
  }

  Pair pair_of(std::int32_t i, std::int32_t j) const {
    const auto a = static_cast<std::size_t>(cluster_of_[i]);
    const auto b = static_cast<std::size_t>(cluster_of_[j]);
    return {std::min(a, b), std::max(a, b)};
  }

  /// The plane of a cluster near one of its edges on the line; `inwards` is +1 or -1.
  const Plane* plane_near(const Line& line, std::int32_t k, int inwards) const {
    const std::int32_t owner = cluster_of_[line.at(k)];
    for (int n = 0; n < kEdgePixels; ++n, k += inwards) {
      if (k < 0 || k >= line.count || cluster_of_[line.at(k)] != owner) return nullptr;
      const std::uint16_t plane = planes_.plane_of[line.at(k)];
      if (plane != PlaneSegmentation::kNoPlane) return &planes_.planes[plane];
    }
    return nullptr;
  }

  /// How far the other side of a container may be whose near side has the pixel.
  float depth_of(std::int32_t i) const {
    const OrientedBox& box = clusters_[static_cast<std::size_t>(cluster_of_[i])].box;
    return kDeepest * static_cast<float>(std::max(box.size_m.x(), box.size_m.y()));
  }

  double distance_of(std::size_t cluster) const {
    return (clusters_[cluster].box.pose.position_W - cloud_.T_W_C.translation()).head<2>().norm();
  }

  bool has_top(const Line& column, std::int32_t k) const {
    const Plane* plane = plane_near(column, k, -1);
    return plane != nullptr && plane->normal_W.z() > kTopCos;
  }

  float top_of(const Cluster& cluster) const {
    std::vector<float> z;
    for (const std::int32_t i : cluster.members) z.push_back(cloud_.z_W[i]);
    const auto at = z.begin() + static_cast<std::ptrdiff_t>(z.size() - 1 - z.size() / 50);
    std::nth_element(z.begin(), at, z.end());
    return *at;
  }

  /// Both end at one height, which the camera looks down on.
  bool same_height(const Pair& pair) const {
    const float a = top_of(clusters_[pair.first]), b = top_of(clusters_[pair.second]);
    return std::abs(a - b) < 2.0f * static_cast<float>(spacing_m_) &&
           static_cast<float>(cloud_.T_W_C.translation().z()) > std::max(a, b);
  }

  const OrganizedCloud& cloud_;
  const SegmentationConfig& config_;
  const DepthNoise& noise_;
  const double spacing_m_;
  const PlaneSegmentation& planes_;
  const std::vector<Cluster>& clusters_;
  std::vector<std::int32_t> cluster_of_;  // per grid pixel
  std::vector<int> extents_;              // per cluster: lines on which it has pixels
  std::vector<std::int32_t> counted_;
  std::map<Pair, int> bridges_, breaks_;
  std::map<Pair, int> edges_;  // the nearer piece first
};

}  // namespace

std::vector<std::size_t> find_pieces(const OrganizedCloud& cloud, const SegmentationConfig& config,
                                     const DepthNoise& noise, double spacing_m,
                                     const PlaneSegmentation& planes,
                                     const std::vector<Cluster>& clusters) {
  return Pieces(cloud, config, noise, spacing_m, planes, clusters).find();
}

}  // namespace pocd

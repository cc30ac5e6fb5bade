#include "pocd/objects/object_model.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// 21 bits per axis: +-1 million cells, 50 km at 5 cm.
constexpr std::int64_t kBias = 1 << 20;

std::uint64_t pack(std::int64_t x, std::int64_t y, std::int64_t z) {
  return static_cast<std::uint64_t>((x + kBias) & 0x1FFFFF) |
         static_cast<std::uint64_t>((y + kBias) & 0x1FFFFF) << 21 |
         static_cast<std::uint64_t>((z + kBias) & 0x1FFFFF) << 42;
}

}  // namespace

ObjectModel::ObjectModel(double spacing_m)
    : spacing_m_(spacing_m), inverse_spacing_(static_cast<float>(1.0 / spacing_m)) {}

std::uint64_t ObjectModel::cell_of(const Eigen::Vector3f& p) const {
  const auto cell = [&](float v) {
    return static_cast<std::int64_t>(std::floor(v * inverse_spacing_));
  };
  return pack(cell(p.x()), cell(p.y()), cell(p.z()));
}

int ObjectModel::nearest(const Eigen::Vector3f& point_W, float radius_m) const {
  const Eigen::Vector3f scaled = point_W * inverse_spacing_;
  const float reach = radius_m * inverse_spacing_;
  const Eigen::Vector3f low = (scaled.array() - reach).floor(),
                        high = (scaled.array() + reach).floor();
  int best = kNone;
  float best_distance = radius_m * radius_m;
  for (auto z = static_cast<std::int64_t>(low.z()); z <= static_cast<std::int64_t>(high.z()); ++z) {
    for (auto y = static_cast<std::int64_t>(low.y()); y <= static_cast<std::int64_t>(high.y());
         ++y) {
      for (auto x = static_cast<std::int64_t>(low.x()); x <= static_cast<std::int64_t>(high.x());
           ++x) {
        const auto it = index_.find(pack(x, y, z));
        if (it == index_.end()) continue;
        const float distance = (surfels_[it->second].point_W - point_W).squaredNorm();
        if (distance <= best_distance) {
          best_distance = distance;
          best = it->second;
        }
      }
    }
  }
  return best;
}

double ObjectModel::explained_share(const std::vector<SurfacePoint>& points, float radius_m,
                                    int budget) const {
  if (points.empty() || surfels_.empty()) return 0.0;
  const std::size_t step =
      std::max<std::size_t>(1, points.size() / static_cast<std::size_t>(budget));
  int looked = 0, found = 0;
  for (std::size_t i = 0; i < points.size(); i += step) {
    ++looked;
    if (nearest(points[i].point_W, radius_m) != kNone) ++found;
  }
  return static_cast<double>(found) / looked;
}

int ObjectModel::fuse(const std::vector<SurfacePoint>& points, StampNs stamp_ns) {
  // Cap: an old surfel still follows a new measurement of the same noise by a thirtieth per frame.
  constexpr float kMaxFrames = 30.0f;
  int added = 0;
  for (const SurfacePoint& p : points) {
    const float w = 1.0f / std::max(1e-6f, p.sigma_m * p.sigma_m);
    const int i = nearest(p.point_W, static_cast<float>(0.75 * spacing_m_));
    if (i == kNone) {
      const auto [it, fresh] =
          index_.try_emplace(cell_of(p.point_W), static_cast<std::int32_t>(surfels_.size()));
      if (!fresh) continue;
      surfels_.push_back({p.point_W, p.normal_W, w, 1, 0, p.arrived, stamp_ns});
      ++added;
      continue;
    }
    Surfel& s = surfels_[i];
    const std::uint64_t old_cell = cell_of(s.point_W);
    const float gain = w / (s.weight + w);
    const Eigen::Vector3f step = p.point_W - s.point_W;
    // Sideways the surfel stays: surfels spread evenly instead of following where pixels are dense.
    if (s.normal_W.squaredNorm() > 0.5f) {
      s.point_W += s.normal_W * (gain * s.normal_W.dot(step));
    } else {
      s.point_W += gain * step;
    }
    refile(i, old_cell);
    if (p.normal_W.squaredNorm() > 0.5f) {
      const Eigen::Vector3f n = s.normal_W + (p.normal_W - s.normal_W) * gain;
      s.normal_W = n.norm() > 1e-3f ? n.normalized() : p.normal_W;
    }
    // A noisy look takes nothing away that precise ones gave.
    s.weight = std::max(s.weight, std::min(s.weight + w, kMaxFrames * w));
    if (s.last_hit_ns != stamp_ns) {
      s.hits = static_cast<std::uint16_t>(std::min<int>(s.hits + 1, 60000));
    }
    s.last_hit_ns = stamp_ns;
    s.seen_through = 0;
  }
  return added;
}

void ObjectModel::refile(std::int32_t i, std::uint64_t old_cell) {
  const std::uint64_t cell = cell_of(surfels_[i].point_W);
  if (cell == old_cell) return;
  // Where another one is at home it stays listed in its old cell.
  const auto old = index_.find(old_cell);
  if (old == index_.end() || old->second != i || !index_.try_emplace(cell, i).second) return;
  index_.erase(old_cell);
}

void ObjectModel::absorb(const ObjectModel& other) { add(other.surfels_); }

void ObjectModel::add(const std::vector<Surfel>& surfels) {
  for (const Surfel& s : surfels) {
    if (nearest(s.point_W, static_cast<float>(0.75 * spacing_m_)) != kNone) continue;
    if (index_.try_emplace(cell_of(s.point_W), static_cast<std::int32_t>(surfels_.size())).second) {
      surfels_.push_back(s);
    }
  }
}

std::vector<Surfel> ObjectModel::extract(const std::vector<std::uint8_t>& marked) {
  POCD_CHECK(marked.size() == surfels_.size());
  std::vector<Surfel> out;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < surfels_.size(); ++i) {
    if (marked[i]) {
      out.push_back(surfels_[i]);
    } else {
      surfels_[kept++] = surfels_[i];
    }
  }
  if (out.empty()) return out;
  surfels_.resize(kept);
  rebuild_index();
  return out;
}

void ObjectModel::transform(const Pose& T_new_old) {
  const Eigen::Isometry3f T = T_new_old.cast<float>();
  for (Surfel& s : surfels_) {
    s.point_W = T * s.point_W;
    s.normal_W = T.linear() * s.normal_W;
  }
  rebuild_index();
}

void ObjectModel::rebuild_index() {
  // The nodes of the index are used again: a clear() would ask for memory for every surfel.
  std::vector<decltype(index_)::node_type> nodes;
  nodes.reserve(index_.size());
  while (!index_.empty()) nodes.push_back(index_.extract(index_.begin()));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < surfels_.size(); ++i) {
    const std::uint64_t cell = cell_of(surfels_[i].point_W);
    if (index_.find(cell) != index_.end()) continue;
    const auto next = static_cast<std::int32_t>(kept);
    if (nodes.empty()) {
      index_.emplace(cell, next);
    } else {
      nodes.back().key() = cell;
      nodes.back().mapped() = next;
      index_.insert(std::move(nodes.back()));
      nodes.pop_back();
    }
    surfels_[kept++] = surfels_[i];
  }
  surfels_.erase(surfels_.begin() + static_cast<std::ptrdiff_t>(kept), surfels_.end());
}

}  // namespace pocd

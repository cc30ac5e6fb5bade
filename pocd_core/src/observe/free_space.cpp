#include "pocd/observe/free_space.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

constexpr float kMinDepth = 0.1f;

int floor_div(double v, double size) { return static_cast<int>(std::floor(v / size)); }

}  // namespace

FreeSpace::FreeSpace(double cell_m, std::size_t most_blocks)
    : cell_m_(cell_m), most_blocks_(most_blocks) {
  POCD_CHECK(cell_m > 0.0);
}

FreeSpace::Place FreeSpace::place_of(const Eigen::Vector3f& point_W) const {
  const int x = floor_div(point_W.x(), cell_m_), y = floor_div(point_W.y(), cell_m_),
            z = floor_div(point_W.z(), cell_m_);
  return {{x >> 3, y >> 3, z >> 3}, (x & 7) + 8 * ((y & 7) + 8 * (z & 7))};
}

bool FreeSpace::seen_empty(const Eigen::Vector3f& point_W) const {
  const Place place = place_of(point_W);
  const auto it = blocks_.find(place.block);
  return it != blocks_.end() && (*it->second)[place.cell] >= kLooks;
}

void FreeSpace::forget_behind(const Eigen::Vector3f& eye_W, const Eigen::Vector3f& surface_W,
                              double depth_m) {
  const Eigen::Vector3f along = (surface_W - eye_W).normalized();
  for (double at = 0.0; at <= depth_m; at += 0.5 * cell_m_) {
    const Place place = place_of(surface_W + static_cast<float>(at) * along);
    const auto it = blocks_.find(place.block);
    if (it == blocks_.end()) continue;
    (*it->second)[place.cell] = 0;
    if (notes_changes_) changed_.insert(place.block);
  }
}

void FreeSpace::update(const OrganizedCloud& cloud, const DepthField& field,
                       const DepthNoise& noise, double max_depth_m, double pose_tolerance_m) {
  left_out_ = 0;
  const CameraModel& camera = cloud.camera;
  const double block_m = cell_m_ * kSide;
  const Pose T_C_W = cloud.T_W_C.inverse();
  const Eigen::Matrix3f R = T_C_W.linear().cast<float>();
  std::array<Eigen::Vector3f, kCells> offset;  // of the cells' centres from the block's corner [C]
  for (int i = 0; i < kCells; ++i) {
    offset[i] = R *
                (Eigen::Vector3f(static_cast<float>(i & 7), static_cast<float>(i >> 3 & 7),
                                 static_cast<float>(i >> 6))
                     .array() +
                 0.5f)
                    .matrix() *
                static_cast<float>(cell_m_);
  }
  // Corners of the view, in the world.
  Eigen::Vector3d low = cloud.T_W_C.translation(), high = low;
  for (const double u : {0.0, static_cast<double>(cloud.width)}) {
    for (const double v : {0.0, static_cast<double>(cloud.height)}) {
      const Eigen::Vector3d corner =
          cloud.T_W_C * Eigen::Vector3d((u - camera.cx) / camera.fx * max_depth_m,
                                        (v - camera.cy) / camera.fy * max_depth_m, max_depth_m);
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx) + 0.5f, cy = static_cast<float>(camera.cy) + 0.5f;
  const auto limit = static_cast<float>(max_depth_m);
  const float half_diagonal = static_cast<float>(0.5 * std::sqrt(3.0) * cell_m_);
  const float radius_px = static_cast<float>(0.5 * cell_m_ + pose_tolerance_m) * fx;
  const float ball = static_cast<float>(0.5 * std::sqrt(3.0) * block_m);
  const float slope_x = static_cast<float>(std::max(camera.cx, cloud.width - camera.cx)) / fx;
  const float slope_y = static_cast<float>(std::max(camera.cy, cloud.height - camera.cy)) / fy;
  const float wide_x = ball * std::sqrt(1.0f + slope_x * slope_x);
  const float wide_y = ball * std::sqrt(1.0f + slope_y * slope_y);

  for (int bz = floor_div(low.z(), block_m); bz <= floor_div(high.z(), block_m); ++bz) {
    for (int by = floor_div(low.y(), block_m); by <= floor_div(high.y(), block_m); ++by) {
      for (int bx = floor_div(low.x(), block_m); bx <= floor_div(high.x(), block_m); ++bx) {
        const Eigen::Vector3f corner_C =
            (T_C_W * (Eigen::Vector3d(bx, by, bz) * block_m)).cast<float>();
        const Eigen::Vector3f center_C =
            corner_C + R * Eigen::Vector3f::Constant(static_cast<float>(0.5 * block_m));
        if (center_C.z() < -ball || center_C.z() > limit + ball ||
            std::abs(center_C.x()) > slope_x * center_C.z() + wide_x ||
            std::abs(center_C.y()) > slope_y * center_C.z() + wide_y) {
          continue;
        }
        const auto it = blocks_.find({bx, by, bz});
        Block* block = it == blocks_.end() ? nullptr : it->second.get();
        for (int i = 0; i < kCells; ++i) {
          const Eigen::Vector3f p = corner_C + offset[i];
          if (p.z() < kMinDepth || p.z() > limit) continue;
          const float u = fx * p.x() / p.z() + cx, v = fy * p.y() / p.z() + cy;
          if (u < 0.0f || v < 0.0f) continue;
          const int col = static_cast<int>(u), row = static_cast<int>(v);
          if (col >= cloud.width || row >= cloud.height) continue;
          const std::size_t pixel = static_cast<std::size_t>(row) * cloud.width + col;
          const float depth = cloud.depth_m[pixel];
          if (depth <= 0.0f || cloud.kind[pixel] == PixelKind::kDynamic ||
              cloud.kind[pixel] == PixelKind::kIgnore) {
            continue;
          }
          if (std::abs(depth - p.z()) <= half_diagonal) {
            if (block) (*block)[i] = 0;
            continue;
          }
          const float behind = p.z() + half_diagonal + static_cast<float>(pose_tolerance_m) +
                               3.0f * static_cast<float>(noise.sigma(p.z()));
          if (depth <= behind || field.nearest(col, row, radius_px / p.z()) <= behind) continue;
          if (!block && blocks_.size() >= most_blocks_) {
            ++left_out_;
            break;
          }
          if (!block) {
            auto& made = blocks_[{bx, by, bz}];
            made = std::make_unique<Block>();
            made->fill(0);
            block = made.get();
          }
          if ((*block)[i] < 255) ++(*block)[i];
        }
        if (block && notes_changes_) changed_.insert({bx, by, bz});
      }
    }
  }
}

std::optional<std::string> FreeSpace::problem() const {
  if (left_out_ == 0) return std::nullopt;
  return "free space has " + std::to_string(most_blocks_) +
         " blocks, the most there may be, and no room for " + std::to_string(left_out_) +
         " more: what arrives there is told as found";
}

void FreeSpace::forget_where(const std::function<bool(const Eigen::Vector2d&)>& inside) {
  for (auto entry = blocks_.begin(); entry != blocks_.end();) {
    const BlockKey key = entry->first;
    Block& block = *entry->second;
    bool changed = false, left = false;
    for (int i = 0; i < kCells; ++i) {
      const Eigen::Vector2d center(kSide * key.x + (i & 7) + 0.5,
                                   kSide * key.y + (i >> 3 & 7) + 0.5);
      if (block[i] != 0 && inside(center * cell_m_)) {
        block[i] = 0;
        changed = true;
      }
      left |= block[i] != 0;
    }
    if (changed && notes_changes_) changed_.insert(key);
    entry = changed && !left ? blocks_.erase(entry) : std::next(entry);
  }
}

std::set<BlockKey> FreeSpace::take_changed() {
  std::set<BlockKey> keys = std::move(changed_);
  changed_.clear();
  if (!std::exchange(notes_changes_, true)) {
    for (const auto& entry : blocks_) keys.insert(entry.first);
  }
  return keys;
}

}  // namespace pocd

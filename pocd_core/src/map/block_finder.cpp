#include "block_finder.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "pocd/common/check.hpp"
#include "region.hpp"

namespace pocd {
namespace {

// Bounds the memory of the grid; 64 M cells are a 100 m range with 3 cm voxels.
constexpr double kMaxCells = 64e6;
// A pose that was refined after check_view turns the pyramid by a little.
constexpr double kMaxCellsRefined = 1.5 * kMaxCells;
constexpr double kMaxIndex = 1e8, kMaxIndexRefined = 1.01 * kMaxIndex;

constexpr std::uint32_t kNoOwner = 0;

// Points along a ray through the band: at most half a block apart, so that a block that lies
// between two points is cut at a corner only and neighbouring rays find it.
float points_along_band(const TsdfConfig& config, const CameraModel& camera) {
  const double x = std::max(camera.cx, camera.width - camera.cx) / camera.fx;
  const double y = std::max(camera.cy, camera.height - camera.cy) / camera.fy;
  const double length_voxels = 2.0 * config.truncation_voxels * std::sqrt(1.0 + x * x + y * y);
  return static_cast<float>(std::ceil(length_voxels / (0.5 * VoxelBlock::kSide)));
}

/// Blocks of the bounding box of the viewing pyramid: the first one, and how many.
struct ViewBox {
  Eigen::Vector3d first, size;
};

ViewBox view_box(const TsdfConfig& config, const CameraModel& camera, const Pose& T_W_C,
                 double most_cells, double largest_index) {
  const double block_m = config.voxel_size_m * VoxelBlock::kSide;
  const double reach = config.max_depth_m + config.truncation_m();
  Eigen::Vector3d low = T_W_C.translation(), high = low;
  for (const double u : {-0.5, camera.width - 0.5}) {
    for (const double v : {-0.5, camera.height - 0.5}) {
      const Eigen::Vector3d corner_W = T_W_C * camera.back_project(u, v, reach);
      low = low.cwiseMin(corner_W);
      high = high.cwiseMax(corner_W);
    }
  }
  // One cell of margin on every side for rounding; cell 0 is therefore never met and collects the
  // invalid samples.
  const Eigen::Vector3d first = (low / block_m).array().floor() - 1.0;
  const Eigen::Vector3d size = (high / block_m).array().floor() + 2.0 - first.array();
  if (!(size.prod() <= most_cells) || !(first.cwiseAbs().maxCoeff() <= largest_index)) {
    throw InputError("map: the view up to max_depth_m = " + std::to_string(config.max_depth_m) +
                     " holds too many voxels of voxel_size_m = " +
                     std::to_string(config.voxel_size_m) + ", or the pose is too far away");
  }
  return {first, size};
}

}  // namespace

void check_view(const TsdfConfig& config, const CameraModel& camera, const Pose& T_W_C) {
  view_box(config, camera, T_W_C, kMaxCells, kMaxIndex);
}

void BlockFinder::place_grid() {
  const auto [first, size] = view_box(config_, input_->frame->camera, input_->frame->T_W_C,
                                      kMaxCellsRefined, kMaxIndexRefined);
  first_ = {static_cast<int>(first.x()), static_cast<int>(first.y()), static_cast<int>(first.z())};
  size_x_ = static_cast<int>(size.x());
  size_y_ = static_cast<int>(size.y());
  size_z_ = static_cast<int>(size.z());
}

void BlockFinder::scan(const TsdfConfig& config, const IntegrationInput& input, ThreadPool& pool) {
  input_ = &input;
  config_ = config;
  block_m_ = config.voxel_size_m * VoxelBlock::kSide;
  place_grid();
  const std::size_t cells = static_cast<std::size_t>(size_x_) * size_y_ * size_z_;
  marks_.assign(cells, 0);

  // At least three samples across a block at the depth limit. A block that fewer pixels see, at the
  // image border or an outline, may be found only in a later frame.
  const CameraModel& camera = input.frame->camera;
  const double block_px = block_m_ * std::min(camera.fx, camera.fy) / config.max_depth_m;
  step_px_ = block_px >= 12.0 ? 4 : block_px >= 6.0 ? 2 : 1;
  columns_.clear();
  owner_columns_.clear();
  for (int u = step_px_ / 2; u < camera.width; u += step_px_) {
    columns_.push_back(u);
    owner_columns_.push_back(input.owners ? std::min(u / input.owner_stride, input.owner_width - 1)
                                          : 0);
  }
  tiles_x_ = (camera.width + kTile_px - 1) / kTile_px;
  tiles_y_ = (camera.height + kTile_px - 1) / kTile_px;
  tile_far_.assign(static_cast<std::size_t>(tiles_x_) * tiles_y_, 0.0f);
  const auto points = static_cast<std::size_t>(points_along_band(config, camera)) + 1;
  cells_.resize(points * kBandBatch * tiles_y_);
  pool.parallel_for(tiles_y_, 1, [this](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) scan_tile_row(static_cast<int>(row));
  });
}

void BlockFinder::scan_tile_row(int tile_row) {
  const Frame& frame = *input_->frame;
  const CameraModel& camera = frame.camera;
  const Eigen::Matrix3d R = frame.T_W_C.linear();
  const Eigen::Vector3d origin =
      frame.T_W_C.translation() / block_m_ - Eigen::Vector3d(first_.x, first_.y, first_.z);
  BandRow row;
  row.truncation = static_cast<float>(config_.truncation_m());
  row.samples = points_along_band(config_, camera);
  row.size_x = size_x_;
  row.size_xy = size_x_ * size_y_;
  const int points = static_cast<int>(row.samples) + 1;
  const float max_depth = static_cast<float>(config_.max_depth_m);
  float* far = tile_far_.data() + static_cast<std::ptrdiff_t>(tile_row) * tiles_x_;
  const int samples = static_cast<int>(columns_.size());
  const int per_tile = kTile_px / step_px_;
  alignas(64) float depth[kBandBatch];
  std::int32_t* cells = cells_.data() + static_cast<std::ptrdiff_t>(tile_row) * points * kBandBatch;

  const int last_v = std::min(camera.height, (tile_row + 1) * kTile_px);
  for (int v = tile_row * kTile_px + step_px_ / 2; v < last_v; v += step_px_) {
    const Eigen::Vector3d start = R * camera.back_project(0.0, v, 1.0) / block_m_;
    const Eigen::Vector3d column = R.col(0) / (camera.fx * block_m_);
    for (int axis = 0; axis < 3; ++axis) {
      row.origin[axis] = static_cast<float>(origin[axis]);
      row.row[axis] = static_cast<float>(start[axis]);
      row.column[axis] = static_cast<float>(column[axis]);
    }
    const float* image_row = frame.depth_m.ptr<float>(v);
    const std::uint32_t* owner_row =
        input_->owners
            ? input_->owners + static_cast<std::ptrdiff_t>(input_->owner_width) *
                                   std::min(v / input_->owner_stride, input_->owner_height - 1)
            : &kNoOwner;
    for (int first = 0; first < samples; first += kBandBatch) {
      const int count = std::min(kBandBatch, samples - first);
      sample_row(image_row, owner_row, columns_.data() + first, owner_columns_.data() + first,
                 max_depth, count, depth);
      for (int i = 0; i < count;) {
        const int tile = (first + i) / per_tile;
        const int end = std::min(count, (tile + 1) * per_tile - first);
        float farthest = far[tile];
        for (; i < end; ++i) {
          farthest = depth[i] > farthest ? depth[i] : farthest;
          if (config_.clear_beyond_limit && image_row[columns_[first + i]] > max_depth &&
              owner_row[owner_columns_[first + i]] != IntegrationInput::kSkip) {
            farthest = max_depth;
          }
        }
        far[tile] = farthest;
      }
      band_cells(row, depth, count, static_cast<float>(columns_[first]),
                 static_cast<float>(step_px_), cells);
      for (int i = 0; i < points * count; ++i) {
        // Most are marked already: a line that is only read stays in every processor's cache.
        std::uint8_t* const mark = &marks_[cells[i]];
        if (__atomic_load_n(mark, __ATOMIC_RELAXED) == 0) {
          __atomic_store_n(mark, std::uint8_t{1}, __ATOMIC_RELAXED);
        }
      }
    }
  }
}

const std::vector<BlockKey>& BlockFinder::band() {
  band_.clear();
  if (!marks_.empty()) marks_[0] = 0;  // the invalid samples
  const std::uint8_t* row = marks_.data();
  const auto width = static_cast<std::size_t>(size_x_);
  for (int z = 0; z < size_z_; ++z) {
    for (int y = 0; y < size_y_; ++y, row += width) {
      const std::uint8_t* at = row;
      const auto next = [&] {
        return static_cast<const std::uint8_t*>(
            std::memchr(at, 1, static_cast<std::size_t>(row + width - at)));
      };
      for (const std::uint8_t* found = next(); found != nullptr; found = next()) {
        band_.push_back({first_.x + static_cast<int>(found - row), first_.y + y, first_.z + z});
        at = found + 1;
      }
    }
  }
  return band_;
}

float BlockFinder::farthest_depth(const Eigen::Vector3d& center_C, double radius) const {
  const CameraModel& camera = input_->frame->camera;
  const double near = center_C.z() - radius;
  if (center_C.z() < -radius || near > config_.max_depth_m) return 0.0f;
  int first_u = 0, last_u = tiles_x_ - 1, first_v = 0, last_v = tiles_y_ - 1;
  if (near > 0.05) {
    // The sphere's image lies within the image of the box around it.
    const double far = center_C.z() + radius;
    const auto tile_range = [&](double p, double f, double c, int tiles, int& first, int& last) {
      const double a = p - radius, b = p + radius;
      const double low = f * a / (a > 0 ? far : near) + c, high = f * b / (b > 0 ? near : far) + c;
      first = std::max(first, static_cast<int>(std::floor(std::max(low, 0.0) / kTile_px)));
      last = high < 0.0 ? -1
                        : std::min(last, static_cast<int>(std::min(high / kTile_px, tiles * 1.0)));
    };
    tile_range(center_C.x(), camera.fx, camera.cx, tiles_x_, first_u, last_u);
    tile_range(center_C.y(), camera.fy, camera.cy, tiles_y_, first_v, last_v);
  }
  float far_depth = 0.0f;
  for (int v = first_v; v <= last_v; ++v) {
    for (int u = first_u; u <= last_u; ++u) {
      far_depth = std::max(far_depth, tile_far_[static_cast<std::size_t>(v) * tiles_x_ + u]);
    }
  }
  return far_depth;
}

bool BlockFinder::in_band(const BlockKey& key) const {
  const int x = key.x - first_.x, y = key.y - first_.y, z = key.z - first_.z;
  if (x < 0 || x >= size_x_ || y < 0 || y >= size_y_ || z < 0 || z >= size_z_) return false;
  return marks_[(static_cast<std::size_t>(z) * size_y_ + y) * size_x_ + x] != 0;
}

void BlockFinder::append_seen(BlockStore& store, ThreadPool& pool,
                              std::vector<std::uint32_t>& slots) {
  const Pose T_C_W = input_->frame->T_W_C.inverse();
  constexpr int kShift = BlockStore::kRegionShift;
  const double block_radius = 0.5 * std::sqrt(3.0) * block_m_;
  const double region_radius = block_radius * (1 << kShift);
  regions_.clear();
  seen_begin_.clear();
  std::size_t members = 0;
  for (int z = first_.z >> kShift; z <= (first_.z + size_z_ - 1) >> kShift; ++z) {
    for (int y = first_.y >> kShift; y <= (first_.y + size_y_ - 1) >> kShift; ++y) {
      for (int x = first_.x >> kShift; x <= (first_.x + size_x_ - 1) >> kShift; ++x) {
        BlockStore::Region* region = store.region({x, y, z});
        if (!region) continue;
        const Eigen::Vector3d center_W =
            (Eigen::Vector3d(x, y, z).array() + 0.5) * block_m_ * (1 << kShift);
        if (farthest_depth(T_C_W * center_W, region_radius) == 0.0f) continue;
        store.enter(*region);
        regions_.push_back(region);
        seen_begin_.push_back(members);
        members += region->memory->members.size();
      }
    }
  }
  // Half the extent of a block along the optical axis.
  const double half_z = 0.5 * block_m_ * T_C_W.linear().row(2).cwiseAbs().sum();
  const double truncation = config_.truncation_m();
  seen_.resize(members);
  pool.parallel_for(regions_.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      std::uint8_t* seen = seen_.data() + seen_begin_[r];
      // Keys from the region: those in the blocks lie far apart.
      for (const std::uint16_t place : regions_[r]->memory->places) {
        const BlockKey key = regions_[r]->block_at(place);
        std::uint8_t& here = *seen++;
        here = 0;
        if (in_band(key)) continue;
        const Eigen::Vector3d block_W =
            (Eigen::Vector3d(key.x, key.y, key.z).array() + 0.5) * block_m_;
        const Eigen::Vector3d block_C = T_C_W * block_W;
        const float far = farthest_depth(block_C, block_radius);
        here = far > 0.0f && block_C.z() - half_z < far + truncation;
      }
    }
  });
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    const std::uint8_t* seen = seen_.data() + seen_begin_[r];
    for (const std::uint32_t slot : regions_[r]->memory->members) {
      if (*seen++) slots.push_back(slot);
    }
  }
}

}  // namespace pocd

// Where nothing was seen to be: what stands in such a place later has arrived.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>

#include "pocd/map/voxel_block.hpp"
#include "pocd/observe/visibility.hpp"

namespace pocd {

/// A grid of cells over the space that cameras have looked at. Each cell counts the looks that saw
/// all of it empty since something was last measured in it. Memory follows the space that was
/// looked at (512 bytes per block of 8 x 8 x 8 cells), not time, and has an end even when poses
/// wander off. Not thread-safe.
class FreeSpace {
 public:
  /// Half a gigabyte; 10 000 m2 of rooms take 38 250 with cells of 0.1 m (docs/memory.md).
  static constexpr std::size_t kMostBlocks = std::size_t{1} << 20;

  /// `cell_m`: edge of a cell [m], > 0. Of more space than `most_blocks` nothing is kept.
  explicit FreeSpace(double cell_m, std::size_t most_blocks = kMostBlocks);

  /// Takes in one frame up to `max_depth_m`. A cell counts as seen empty when every return around
  /// its projection lies behind all of it by more than three sigma of the depth noise and
  /// `pose_tolerance_m`; a cell in which a return lies starts anew. Pixels without a return and
  /// pixels of moving things say nothing.
  void update(const OrganizedCloud& cloud, const DepthField& field, const DepthNoise& noise,
              double max_depth_m, double pose_tolerance_m);

  /// Whether at least `kLooks` looks saw the cell of the point empty, and nothing was measured
  /// there since.
  bool seen_empty(const Eigen::Vector3f& point_W) const;
  static constexpr int kLooks = 3;

  /// Something arrived at `surface_W`, seen from `eye_W`: what was known of the space behind it, up
  /// to `depth_m`, is known no more.
  void forget_behind(const Eigen::Vector3f& eye_W, const Eigen::Vector3f& surface_W,
                     double depth_m);
  /// Nothing is known any more of the cells whose centre [m, W] `inside` accepts.
  void forget_where(const std::function<bool(const Eigen::Vector2d&)>& inside);

  std::size_t block_count() const { return blocks_.size(); }
  /// Blocks that the last update saw empty and had no room for.
  std::size_t left_out() const { return left_out_; }
  /// A line that says so; nothing when there are none.
  std::optional<std::string> problem() const;

  /// Keys of the blocks that may have changed since the last call, for who writes them down; noted
  /// from the first call on.
  std::set<BlockKey> take_changed();

 private:
  friend struct ArchiveAccess;
  static constexpr int kSide = 8;
  static constexpr int kCells = kSide * kSide * kSide;
  using Block = std::array<std::uint8_t, kCells>;
  struct Place {
    BlockKey block;
    int cell = 0;  ///< number within the block
  };
  Place place_of(const Eigen::Vector3f& point_W) const;

  double cell_m_;
  std::size_t most_blocks_;
  std::unordered_map<BlockKey, std::unique_ptr<Block>, BlockKeyHash> blocks_;  ///< looked up only
  std::size_t left_out_ = 0;
  bool notes_changes_ = false;
  std::set<BlockKey> changed_;
};

}  // namespace pocd

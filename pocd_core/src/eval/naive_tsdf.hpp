// A plain TSDF for the methods that the pipeline is compared with: slow, obvious, and without any
// correction of its own.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "pocd/input/frame.hpp"
#include "pocd/map/tsdf_map.hpp"

namespace pocd {

/// Curless and Levoy (SIGGRAPH 1996) with the weights of Voxblox (Oleynikova et al., IROS 2017): 1
/// / z^2, falling off linearly behind the surface from one voxel on. Free space in front of the
/// surface is averaged in like any other observation. Not thread-safe.
class NaiveTsdf {
 public:
  struct Block {
    std::array<float, VoxelBlock::kVoxels> distance{};  ///< over truncation, in [-1, 1]
    std::array<float, VoxelBlock::kVoxels> weight{};
    BlockKey key;
  };

  /// max_weight in units of observations at 1 m.
  NaiveTsdf(const TsdfConfig& config, float max_weight)
      : config_(config), max_weight_(max_weight) {}

  /// `mask` (CV_8UC1 of the frame's size, or empty): pixels with 0 are not used at all; pixels
  /// below 2 make no new blocks but may update those that are there.
  void integrate(const Frame& frame, const cv::Mat& mask);

  /// See surface_points; min_weight in the units of max_weight.
  Points surface(float min_weight) const;
  std::size_t block_count() const { return blocks_.size(); }
  const std::vector<std::unique_ptr<Block>>& blocks() const { return blocks_; }
  /// Averages the other grid in, block by block.
  void merge(const NaiveTsdf& other);
  /// Signed distance over truncation at the voxel that holds the point; false where never observed.
  bool distance_at(const Eigen::Vector3f& point_W, float min_weight, float& distance) const;

  static constexpr std::uint8_t kUpdateOnly = 1, kUse = 2;

 private:
  Block& block_at(const BlockKey& key);
  void allocate(const Frame& frame, const cv::Mat& mask);

  TsdfConfig config_;
  float max_weight_;
  std::vector<std::unique_ptr<Block>> blocks_;                     // in order of creation
  std::unordered_map<BlockKey, std::size_t, BlockKeyHash> index_;  // look-up only
};

}  // namespace pocd

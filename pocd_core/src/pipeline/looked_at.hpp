// When each region of the map was last looked at.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "pocd/map/voxel_block.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd/segmentation/organized_cloud.hpp"

namespace pocd {

/// Regions are those of the map (BlockKey::kRegionShift). Not thread-safe.
class LookedAt {
 public:
  /// `voxel_size_m`: of the map, > 0.
  explicit LookedAt(double voxel_size_m);

  /// From here on looks are noted.
  void start() { on_ = true; }
  /// Every region in which the frame has measured a surface was looked at, by a sample of its
  /// pixels. Nothing before start().
  void note(const OrganizedCloud& cloud, StampNs stamp_ns);

  /// Regions that were looked at since the last call, ascending.
  std::vector<RegionLook> take();
  /// All there are, ascending.
  std::vector<RegionLook> all() const;
  /// Keys of what take() gives, for who writes them down; all there are at the first call.
  std::set<BlockKey> take_changed();

 private:
  friend struct ArchiveAccess;
  float inverse_m_;
  std::map<BlockKey, StampNs> last_ns_;
  std::set<BlockKey> fresh_, changed_;
  bool on_ = false, notes_changes_ = false;
};

}  // namespace pocd

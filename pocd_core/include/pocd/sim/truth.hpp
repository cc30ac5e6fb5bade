// What is really there, what really changed, and which surface a drive could have seen.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pocd/common/thread_pool.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/sim/scenario.hpp"

namespace pocd {

struct TruthObject {
  std::string name;
  ClassId class_id = 0;
  int stationarity_class = 0;
  OrientedBox box;
};

enum class ChangeKind { kAdded, kRemoved, kMoved };
const char* to_string(ChangeKind kind);  ///< "ADDED", "REMOVED", "MOVED"

struct TruthChange {
  ChangeKind kind = ChangeKind::kAdded;
  std::string name;
  ClassId class_id = 0;
  std::optional<OrientedBox> before;  ///< REMOVED, MOVED
  std::optional<OrientedBox> after;   ///< ADDED, MOVED
};

/// Objects in their places at the end of a visit, in the scenario's order; no fixtures, nothing
/// transient.
std::vector<TruthObject> objects_after(const Scenario& scenario, std::size_t visit);

/// Changes from the end of visit - 1 to the end of `visit` (visit >= 1), by name: removed and moved
/// in the order of the earlier visit, then added. MOVED: centre by more than 1 mm or heading by
/// more than 0.1 degrees. A thing whose class or size changed is REMOVED and ADDED.
std::vector<TruthChange> changes_of(const Scenario& scenario, std::size_t visit);

/// One voxel of true surface. Voxel (x, y, z) covers [x, x + 1) voxel_size_m and so on.
struct SurfaceVoxel {
  std::int32_t x = 0, y = 0, z = 0;
  std::int32_t object = -1;  ///< index into Scene::objects of scene_at(visit, end)
};

struct VisibleSurfaceOptions {
  double voxel_size_m = TsdfConfig{}.voxel_size_m;
  double max_depth_m = TsdfConfig{}.max_depth_m;
  int frame_stride = 1;          ///< uses every n-th frame of each robot
  bool include_fixtures = true;  ///< floor and walls
};

/// Voxels that contain a surface point which some ideal camera of the visit saw within max_depth_m,
/// over the drives of all robots; things that move during the visit or are transient hide what is
/// behind them but give no voxels. Rays are at least two per voxel edge at max_depth_m for surfaces
/// seen face on. A voxel touched by several objects belongs to the one first in the scene. Sorted
/// by z, y, x. Same result for every pool, or none.
std::vector<SurfaceVoxel> visible_surface(const Scenario& scenario, std::size_t visit,
                                          const VisibleSurfaceOptions& options,
                                          ThreadPool* pool = nullptr);

}  // namespace pocd

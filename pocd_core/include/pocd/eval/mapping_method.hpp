// What is evaluated: a method that turns frames into a map. Ours and the ones it is compared with.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pocd/eval/baseline_config.hpp"
#include "pocd/input/frame.hpp"
#include "pocd/objects/frame_result.hpp"
#include "pocd/pipeline/pipeline_config.hpp"

namespace pocd {

/// One run of one method. Not thread-safe; works on the calling thread alone, so that its cost can
/// be read from that thread's clock. Deterministic.
class MappingMethod {
 public:
  virtual ~MappingMethod() = default;

  /// Frames in the order of their stamps. A method without objects returns no events.
  virtual FrameResult process(const Frame& frame) = 0;
  /// Points of the surface of the map as it is now: zero crossings of the signed distance along the
  /// edges of the voxel grid, map frame. Sorted canonically by the grid, not by time.
  virtual Points surface() const = 0;
  /// Confirmed objects by id; none for a method without objects.
  virtual std::vector<ObjectSnapshot> objects() const { return {}; }
  /// Whether process() reports events and objects() beliefs.
  virtual bool has_objects() const { return false; }
};

/// The pipeline itself.
std::unique_ptr<MappingMethod> make_pocd_method(const PipelineConfig& config);

/// Static world: every depth image is averaged into one TSDF, as Voxblox and Kimera do (Oleynikova
/// et al., IROS 2017; Rosinol et al., ICRA 2020).
std::unique_ptr<MappingMethod> make_static_tsdf_method(const PipelineConfig& config,
                                                       const StaticTsdfConfig& own = {});

/// Tracked dynamic objects, after MaskFusion (Runz, Buffier, Agapito, ISMAR 2018).
std::unique_ptr<MappingMethod> make_tracked_objects_method(const PipelineConfig& config,
                                                           const TrackedObjectsConfig& own = {});

/// Voxel-level correction by new observations, after Fehr et al. (ICRA 2017).
std::unique_ptr<MappingMethod> make_voxel_correction_method(const PipelineConfig& config,
                                                            const VoxelCorrectionConfig& own = {});

/// Object submaps with consistency checks, after Panoptic Multi-TSDFs (Schmid et al., ICRA 2022).
std::unique_ptr<MappingMethod> make_submap_method(const PipelineConfig& config,
                                                  const SubmapsConfig& own = {});

}  // namespace pocd

// POCD: frame in, changes out. The story of a frame is PocdPipeline::process_frame.
#pragma once

#include <memory>
#include <vector>

#include "pocd/input/frame.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/pipeline/frame_result.hpp"
#include "pocd/pipeline/pipeline_config.hpp"

namespace pocd {

/// Owns the object library and the map. Not thread-safe; it uses `config.threads` threads inside
/// and gives the same bits for every number of them.
class PocdPipeline {
 public:
  explicit PocdPipeline(const PipelineConfig& config);
  ~PocdPipeline();

  /// Frames of one or several robots, in the order they are to be fused. Throws InputError, and
  /// changes nothing, for a frame that make_frame would not have made, that is smaller than the
  /// stride, or whose view holds too many voxels. Anything merely implausible is a warning in the
  /// result: a pose that jumps, a stamp that lies more than 10 s off those of other robots. When more
  /// of the robots heard lately have a stamp there than not, time went on or, after ten such frames,
  /// the clocks were set back: what is known is known from before.
  FrameResult process_frame(const Frame& frame);

  /// Confirmed objects by id.
  std::vector<ObjectSnapshot> objects() const;
  /// Objects and places that were looked at so far (ObjectLibrary::visits); TsdfMap::visits tells
  /// the same of the map.
  std::uint64_t object_visits() const;
  TsdfMap& map();
  const TsdfMap& map() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd

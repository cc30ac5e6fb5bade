// POCD: frame in, changes out. The story of a frame is PocdPipeline::process_frame.
#pragma once

#include <memory>
#include <vector>

#include "pocd/input/frame.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/objects/frame_result.hpp"
#include "pocd/pipeline/operator_word.hpp"
#include "pocd/pipeline/pipeline_config.hpp"
#include "pocd/pipeline/pipeline_pieces.hpp"

namespace pocd {

/// When a surface in a region of the map was last measured.
struct RegionLook {
  BlockKey region;       ///< block key >> BlockKey::kRegionShift
  StampNs stamp_ns = 0;  ///< of the frame
};

/// Owns the object library and the map. Not thread-safe; it uses `config.threads` threads inside
/// and gives the same bits for every number of them.
class PocdPipeline {
 public:
  /// Throws InputError that names every field with a value that is not allowed, as a file of
  /// parameters would.
  explicit PocdPipeline(const PipelineConfig& config);
  ~PocdPipeline();

  /// Frames of one or several robots, in the order they are to be fused. Throws InputError, and
  /// changes nothing, for a frame that make_frame would not have made, that is smaller than the
  /// stride, or whose view holds too many voxels. Anything merely implausible is a warning in the
  /// result: a pose that jumps, a stamp that lies more than 10 s off those of other robots. When
  /// more of the robots heard lately have a stamp there than not, time went on or, after ten such
  /// frames, the clocks were set back: what is known is known from before.
  FrameResult process_frame(const Frame& frame);

  /// Confirmed objects by id.
  std::vector<ObjectSnapshot> objects() const;
  /// Objects and places that were looked at so far (ObjectLibrary::visits); TsdfMap::visits tells
  /// the same of the map.
  std::uint64_t object_visits() const;

  /// From here on it is noted when regions of the map are looked at; without this, frames cost
  /// nothing for it.
  void note_looks();
  /// Regions in which a surface was measured since the last call, ascending. Without those of
  /// before a restore().
  std::vector<RegionLook> take_looks();
  /// The last look at each region there ever was one at, ascending; those of before a restore(),
  /// too.
  std::vector<RegionLook> looks() const;

  /// Does what an operator says, between two frames; its events have the stamp of the newest frame.
  /// A word that cannot be followed changes nothing, and the outcome says why.
  WordOutcome apply(const OperatorWord& word);

  /// Everything beside the voxels that later frames depend on, as far as it is not what it was at
  /// the last call or at restore(); at the first call, all there is. Between two frames.
  std::vector<Piece> take_changed_pieces();
  /// For a pipeline that has seen no frame: goes on where the one went on that gave these pieces,
  /// all there were at one time. The voxels are TsdfMap::restore's. Throws InputError for pieces
  /// that are none; the pipeline is of no use then.
  void restore(const std::vector<Piece>& pieces);
  /// What the next object and the next event will be called.
  struct Numbers {
    std::uint32_t object = 1;
    std::uint64_t event = 1;
  };
  Numbers numbers() const;
  /// Leaves numbers out that may have been used; none is given twice, so smaller ones change
  /// nothing.
  void skip_to(const Numbers& numbers);

  TsdfMap& map();
  const TsdfMap& map() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd

// What has changed of a pipeline and what is published of it, as one step.
#pragma once

#include "pocd/map/map_delta.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "stored_state.hpp"

namespace pocd::memory {

/// Pieces, voxels and published tiles, since the last call. Voxels that cannot be read back from
/// disk are lost, as TsdfMap says.
void gather_changes(PocdPipeline& pipeline, const MapPublisher& publisher, MemoryStep& step);

}  // namespace pocd::memory

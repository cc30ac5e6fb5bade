// What a run was and what came out of it, as written to summary.yaml.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pocd/common/describe.hpp"
#include "pocd/pipeline/pipeline_config.hpp"

namespace pocd {

/// Written with dump_config, read with load_config.
struct RunSummary {
  std::string version;
  std::string dataset;
  std::vector<std::string> inputs;
  bool stopped_early = false;
  std::uint64_t frames = 0;
  std::uint64_t skipped = 0;
  std::uint64_t refused = 0;
  std::uint64_t added = 0, updated = 0, moved = 0, removed = 0;
  std::uint64_t objects = 0;
  std::uint64_t map_blocks = 0;
  std::uint64_t map_memory_bytes = 0, map_blocks_on_disk = 0, map_evictions = 0, map_returns = 0;
  std::uint64_t map_write_failures = 0, map_blocks_lost = 0, map_frames_over_budget = 0;
  std::string map_digest;
  std::uint64_t memory_steps = 0, memory_written_bytes = 0, memory_file_bytes = 0;
  double memory_copy_cpu_ms = 0.0, memory_write_cpu_ms = 0.0;
  double seconds = 0.0;
  PipelineConfig config;

  template <class Visitor>
  void describe(Visitor& visit) {
    const Range any{0, 1e18};
    visit("version", version, "Version of the program.");
    visit("dataset", dataset, "Format of the inputs.");
    visit("inputs", inputs, "Inputs in the order of the visit.");
    visit("stopped_early", stopped_early, "Stopped by a signal or by --max-frames.");
    visit("frames", frames, any, "Frames that were processed.");
    visit("skipped", skipped, any, "Frames that could not be read.");
    visit("refused", refused, any, "Frames of `frames` that the pipeline refused as a whole.");
    visit("added", added, any, "Events ADDED.");
    visit("updated", updated, any, "Events UPDATED.");
    visit("moved", moved, any, "Events MOVED.");
    visit("removed", removed, any, "Events REMOVED.");
    visit("objects", objects, any, "Objects in the library at the end.");
    visit("map_blocks", map_blocks, any, "Blocks of 8 x 8 x 8 voxels in the map at the end.");
    visit("map_memory_bytes", map_memory_bytes, any,
          "Memory of voxels and their index at the end [bytes].");
    visit("map_blocks_on_disk", map_blocks_on_disk, any,
          "Those of `map_blocks` that the memory budget has sent to disk.");
    visit("map_evictions", map_evictions, any, "Regions of 8 x 8 x 8 blocks written to disk.");
    visit("map_returns", map_returns, any, "Regions read back because they were seen again.");
    visit("map_write_failures", map_write_failures, any,
          "Regions that the disk did not take: they stayed in memory.");
    visit("map_blocks_lost", map_blocks_lost, any, "Blocks that could not be read back.");
    visit("map_frames_over_budget", map_frames_over_budget, any,
          "Frames that needed more than the memory budget at once.");
    visit("map_digest", map_digest, "Digest of the published map at the end.");
    visit("memory_steps", memory_steps, any, "Steps written to the memory; 0 without one.");
    visit("memory_written_bytes", memory_written_bytes, any, "Rows of all steps [bytes].");
    visit("memory_file_bytes", memory_file_bytes, any,
          "The file after the last step, with its log of changes [bytes].");
    visit("memory_copy_cpu_ms", memory_copy_cpu_ms, any,
          "CPU time for copying what had changed, on the pipeline's thread [ms].");
    visit("memory_write_cpu_ms", memory_write_cpu_ms, any,
          "CPU time for compressing and writing it, on a thread of its own [ms].");
    visit("seconds", seconds, any, "Wall time of reading and processing [s].");
    visit.group("config", config, "The effective configuration.");
  }
};

}  // namespace pocd

// What a run was and what came out of it, as written to summary.yaml.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pocd/config/describe.hpp"
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
  std::string map_digest;
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
    visit("map_digest", map_digest, "Digest of the published map at the end.");
    visit("seconds", seconds, any, "Wall time of reading and processing [s].");
    visit.group("config", config, "The effective configuration.");
  }
};

}  // namespace pocd

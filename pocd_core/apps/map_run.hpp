// An offline run: frames of a data set through the pipeline, results into a folder.
#pragma once

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>

#include "map_memory.hpp"
#include "pocd/config/run_summary.hpp"
#include "pocd/datasets/open_dataset.hpp"

namespace pocd {

struct MapRunOptions {
  DatasetOptions dataset;
  PipelineConfig config;
  /// ONNX model that makes the masks; empty: those of the data set.
  std::filesystem::path network;
  std::filesystem::path output;
  MapMemoryOptions memory;
  std::optional<std::uint64_t> max_frames;
  bool show_progress = false;
  const volatile std::sig_atomic_t* stop = nullptr;  ///< non-zero: finish with what is there
};

/// Writes the files of docs/pocd_map.md and one line to `log` for everything that was left out.
/// Throws InputError when the inputs cannot be read at all, no frame is good, or a file cannot be
/// written.
RunSummary run_map(const MapRunOptions& options, std::ostream& log);

}  // namespace pocd

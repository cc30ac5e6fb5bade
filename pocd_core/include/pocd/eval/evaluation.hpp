// One run of the examiner: one route, one seed, several methods side by side over the same frames.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "pocd/eval/calibration.hpp"
#include "pocd/eval/fault_injection.hpp"
#include "pocd/eval/mapping_method.hpp"
#include "pocd/eval/object_metrics.hpp"
#include "pocd/eval/voxel_metrics.hpp"

namespace pocd {

struct MethodSpec {
  std::string name;
  std::function<std::unique_ptr<MappingMethod>()> make;
};

struct EvaluationInput {
  std::string route;
  std::uint64_t seed = 1;
  std::unique_ptr<DatasetReader> reader;
  /// Frame::sequence of the first frame of each visit, ascending, starting with 0. The last visit
  /// is also mapped alone, as the paper's reference.
  std::vector<std::uint64_t> visit_begin;
  std::shared_ptr<const SceneTruth> truth;  ///< null for recordings
  FaultOptions faults;
  /// Map the last visit alone too and compare with it; a third of the cost of a two-visit run.
  bool with_reference = true;
};

/// E[v] of an object after each frame in which it was in the library: (frame, E[v]).
using History = std::vector<std::pair<std::size_t, double>>;

struct MethodScore {
  std::string method;
  VoxelScore by_reference;
  std::optional<VoxelScore> by_truth;
  std::optional<ObjectScore> objects;  ///< with truth, of methods that have objects
  std::size_t removed_or_moved = 0;    ///< events, right or wrong
  Calibration calibration;
  double cpu_ms_per_frame = 0.0;  ///< of the thread, mean
  std::size_t frames = 0, refused = 0;
  std::map<ObjectId, History> histories;
  std::vector<RunEvents::Timed> events;
};

struct RunScore {
  std::string route;
  std::uint64_t seed = 1;
  std::vector<MethodScore> methods;
  std::vector<std::string> problems;  ///< of the reader
};

/// Throws InputError when the reader has no frames of the last visit. `progress(frames_done)`.
RunScore evaluate_run(EvaluationInput input, const std::vector<MethodSpec>& methods,
                      const VoxelMetricsConfig& voxels, double max_depth_m,
                      const std::function<void(std::size_t)>& progress = nullptr);

}  // namespace pocd

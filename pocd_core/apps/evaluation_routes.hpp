// What is evaluated on: routes with seeds, run several at a time.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pocd/datasets/open_dataset.hpp"
#include "pocd/eval/evaluation.hpp"

namespace pocd {

/// Visits that are mapped one after the other: scenario files, or recordings.
struct Route {
  std::string name;
  std::vector<std::filesystem::path> files;
};

/// Names of the scenario files in a folder, "1-9" before "1-10".
std::vector<std::string> scenario_names(const std::filesystem::path& folder);

struct RunnerOptions {
  std::optional<DatasetFormat> dataset;  ///< of recordings; none: the simulator
  std::vector<std::uint64_t> seeds = {1};
  FaultOptions faults;
  std::filesystem::path sensor;  ///< file of a sensor model for every scenario; empty: its own
  std::vector<std::string> sim;  ///< changes of every scenario, KEY=VALUE
  PipelineConfig config;         ///< for depth limit, map voxels, classes
  VoxelMetricsConfig voxels;
  int jobs = 1;
  bool with_reference = true;
};

/// Runs every route with every seed; all methods of a run see the same frames, which are made once.
class RouteRunner {
 public:
  RouteRunner(const std::vector<Route>& routes, const RunnerOptions& options);

  /// Scores in the order of routes and seeds, whatever order they were made in. `done(n, score)` is
  /// called as each is ready, by one thread at a time; progress with an estimate goes to stderr.
  std::vector<RunScore> run(const std::vector<MethodSpec>& methods,
                            const std::function<void(std::size_t, RunScore&)>& done = nullptr);

 private:
  struct Job {
    const Route* route;
    std::uint64_t seed;
    std::size_t frames = 0;
  };
  Scenario scenario_of(const Route& route) const;
  EvaluationInput input_of(const Job& job);
  void open_recordings(const Route& route, EvaluationInput& input) const;
  std::shared_ptr<const SceneTruth> truth_of(const Route& route, const Scenario& scenario);

  std::vector<Route> routes_;
  RunnerOptions options_;
  std::vector<Job> jobs_;
  struct Truth {
    std::mutex mutex;
    std::shared_ptr<const SceneTruth> made;
  };
  std::map<const Route*, Truth> truths_;
};

}  // namespace pocd

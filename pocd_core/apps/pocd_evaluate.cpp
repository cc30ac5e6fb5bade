// Methods x routes x seeds -> tables and pictures.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <iostream>
#include <map>
#include <mutex>
#include <thread>

#include "evaluate_cli.hpp"
#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/eval/evaluation_report.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"

namespace {

namespace fs = std::filesystem;

struct Route {
  std::string name;
  std::vector<fs::path> files;
};

/// One route with one seed.
struct Job {
  const Route* route;
  std::uint64_t seed;
};

/// "1-10" after "1-9": numbers in names compare as numbers.
bool natural_less(const std::string& a, const std::string& b) {
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

std::vector<Route> list_routes(const pocd::EvaluateOptions& o) {
  std::vector<Route> routes;
  if (!o.dataset.empty()) {
    std::string name;
    for (const fs::path& input : o.inputs)
      name += (name.empty() ? "" : "+") + input.filename().string();
    return {{name, o.inputs}};
  }
  for (const fs::path& file : o.runs) routes.push_back({file.stem().string(), {file}});
  std::vector<std::string> names = o.names;
  if (names.empty() && o.runs.empty()) {
    if (!fs::is_directory(o.scenarios))
      throw pocd::InputError(o.scenarios.string() + ": no such folder");
    for (const auto& entry : fs::directory_iterator(o.scenarios)) {
      if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
    }
    std::sort(names.begin(), names.end(), natural_less);
  }
  for (const std::string& name : names) {
    routes.push_back({o.baseline + "+" + name,
                      {o.scenarios / (o.baseline + ".yaml"), o.scenarios / (name + ".yaml")}});
  }
  return routes;
}

std::vector<pocd::MethodSpec> list_methods(const pocd::EvaluateOptions& o,
                                           const pocd::PipelineConfig& config) {
  std::vector<pocd::MethodSpec> specs;
  for (const std::string& name : o.methods) {
    if (name == "pocd") specs.push_back({name, [=] { return pocd::make_pocd_method(config); }});
    if (name == "static_tsdf")
      specs.push_back({name, [=] { return pocd::make_static_tsdf_method(config); }});
    if (name == "tracked_objects") {
      specs.push_back({name, [=] { return pocd::make_tracked_objects_method(config, false); }});
    }
    if (name == "tracked_objects_keep") {
      specs.push_back({name, [=] { return pocd::make_tracked_objects_method(config, true); }});
    }
    if (name == "voxel_correction") {
      specs.push_back({name, [=] { return pocd::make_voxel_correction_method(config); }});
    }
    if (name == "submaps")
      specs.push_back({name, [=] { return pocd::make_submap_method(config); }});
  }
  for (const std::string& variant : o.variants) {
    const std::size_t equals = variant.find('=');
    const std::string overlay = variant.substr(equals + 1);
    std::vector<fs::path> files = o.config;
    std::vector<std::string> overrides = o.overrides;
    if (overlay.find('=') == std::string::npos) {
      files.push_back(overlay);
    } else {
      for (std::size_t begin = 0; begin <= overlay.size();) {
        const std::size_t end = std::min(overlay.find(',', begin), overlay.size());
        overrides.push_back(overlay.substr(begin, end - begin));
        begin = end + 1;
      }
    }
    pocd::PipelineConfig changed;
    pocd::load_config(changed, files, overrides);
    specs.push_back({variant.substr(0, equals), [=] { return pocd::make_pocd_method(changed); }});
  }
  return specs;
}

class Progress {
 public:
  explicit Progress(std::size_t total) : total_(total), shown_(isatty(STDERR_FILENO) != 0) {}
  void frame() {
    const std::size_t frames = ++frames_;
    if (!shown_ || frames % 20 != 0) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    std::fprintf(stderr, "\r\033[K%zu of %zu runs done, %zu frames", done_.load(), total_, frames);
  }
  void done(const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++done_;
    std::fprintf(stderr, "%s%zu of %zu: %s\n", shown_ ? "\r\033[K" : "", done_.load(), total_,
                 what.c_str());
  }

 private:
  std::size_t total_;
  bool shown_;
  std::atomic<std::size_t> frames_{0}, done_{0};
  std::mutex mutex_;
};

class Evaluation {
 public:
  Evaluation(const pocd::EvaluateOptions& options, const pocd::PipelineConfig& config)
      : options_(options),
        config_(config),
        routes_(list_routes(options)),
        methods_(list_methods(options, config)) {
    voxels_.voxel_size_m = options.voxel_size_m;
    voxels_.map_voxel_m = config.map.voxel_size_m;
    voxels_.tolerance_m = config.map.voxel_size_m;
    voxels_.offset_m = config.map.voxel_size_m;
    voxels_.min_height_m = options.min_height_m;
    voxels_.max_height_m = options.max_height_m;
    for (const Route& route : routes_) {
      if (options.dataset.empty()) {
        for (const std::uint64_t seed : options.seeds) jobs_.push_back({&route, seed});
      } else {
        jobs_.push_back({&route, 0});
      }
    }
  }

  /// Scores in the order of routes and seeds, whatever order they were made in.
  std::vector<pocd::RunScore> run() {
    std::vector<pocd::RunScore> scores(jobs_.size());
    Progress progress(jobs_.size());
    std::atomic<std::size_t> next{0};
    std::exception_ptr failure;
    std::mutex mutex;
    const auto work = [&] {
      for (std::size_t n = next++; n < jobs_.size(); n = next++) {
        try {
          scores[n] =
              pocd::evaluate_run(input_of(jobs_[n]), methods_, voxels_, config_.map.max_depth_m,
                                 [&](std::size_t) { progress.frame(); });
          progress.done(jobs_[n].route->name + " seed " + std::to_string(jobs_[n].seed));
        } catch (...) {
          const std::lock_guard<std::mutex> lock(mutex);
          if (!failure) failure = std::current_exception();
          next = jobs_.size();
        }
      }
    };
    std::vector<std::thread> threads;
    for (int t = 1; t < options_.jobs; ++t) threads.emplace_back(work);
    work();
    for (std::thread& thread : threads) thread.join();
    if (failure) std::rethrow_exception(failure);
    return scores;
  }

  const pocd::VoxelMetricsConfig& voxels() const { return voxels_; }

 private:
  pocd::EvaluationInput input_of(const Job& job) {
    pocd::EvaluationInput input;
    input.route = job.route->name;
    input.seed = job.seed;
    for (const std::string& fault : options_.faults) {
      input.faults.pose_jumps |= fault == "pose_jumps";
      input.faults.mask_gaps |= fault == "mask_gaps";
      input.faults.depth_holes |= fault == "depth_holes";
    }
    input.faults.seed = job.seed;
    if (!options_.dataset.empty()) {
      open_recordings(*job.route, input);
      return input;
    }
    const pocd::Scenario scenario = pocd::load_run(job.route->files);
    input.truth = truth_of(*job.route, scenario);
    input.visit_begin.assign(input.truth->visit_begin.begin(), input.truth->visit_begin.end() - 1);
    pocd::SimReaderOptions reader;
    reader.seed = job.seed;
    reader.with_color = false;
    reader.label_divisor = config_.classes.label_divisor;
    input.reader = std::make_unique<pocd::SimReader>(scenario, reader);
    return input;
  }

  void open_recordings(const Route& route, pocd::EvaluationInput& input) const {
    pocd::DatasetOptions dataset;
    dataset.format = options_.dataset;
    std::uint64_t begin = 0;
    for (const fs::path& file : route.files) {
      input.visit_begin.push_back(begin);
      dataset.inputs = {file};
      begin += pocd::open_dataset(dataset)->size();
    }
    dataset.inputs = route.files;
    input.reader = pocd::open_dataset(dataset);
  }

  /// Made once per route, for all its seeds.
  std::shared_ptr<const pocd::SceneTruth> truth_of(const Route& route,
                                                   const pocd::Scenario& scenario) {
    const std::lock_guard<std::mutex> lock(truth_mutex_);
    auto& truth = truths_[&route];
    if (!truth) {
      pocd::SceneTruthOptions options;
      options.map_voxel_m = config_.map.voxel_size_m;
      options.max_depth_m = config_.map.max_depth_m;
      truth = std::make_shared<pocd::SceneTruth>(pocd::scene_truth(scenario, options, nullptr));
    }
    return truth;
  }

  pocd::EvaluateOptions options_;
  pocd::PipelineConfig config_;
  std::vector<Route> routes_;
  std::vector<pocd::MethodSpec> methods_;
  pocd::VoxelMetricsConfig voxels_;
  std::vector<Job> jobs_;
  std::map<const Route*, std::shared_ptr<const pocd::SceneTruth>> truths_;
  std::mutex truth_mutex_;
};

void write_results(const pocd::EvaluateOptions& o, const pocd::PipelineConfig& config,
                   const pocd::VoxelMetricsConfig& voxels,
                   const std::vector<pocd::RunScore>& runs) {
  const std::vector<pocd::MethodSummary> summaries = pocd::summarize(runs);
  pocd::write_markdown(runs, o.output / "evaluation.md");
  pocd::write_scores_csv(runs, o.output / "scores.csv");
  pocd::write_changes_csv(runs, o.output / "changes.csv");
  pocd::write_calibration_csv(summaries, o.output / "calibration.csv");
  if (!o.pictures) return;
  for (const pocd::MethodSummary& summary : summaries) {
    if (summary.calibration.count() == 0) continue;
    pocd::draw_reliability(summary.calibration, summary.method,
                           o.output / ("reliability_" + summary.method + ".png"));
  }
  for (const pocd::RunScore& run : runs) {
    if (run.seed != runs.front().seed) continue;
    const fs::path folder = o.output / run.route;
    fs::create_directories(folder);
    for (const pocd::MethodScore& m : run.methods) {
      pocd::draw_voxels(m.by_truth ? *m.by_truth : m.by_reference, voxels.voxel_size_m,
                        run.route + "  " + m.method + (m.by_truth ? "  against the truth" : ""),
                        folder / ("birdseye_" + m.method + ".png"));
      if (m.histories.empty()) continue;
      pocd::draw_histories(m, config.state.remove_below,
                           folder / ("stationarity_" + m.method + ".png"));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  pocd::EvaluateOptions options;
  const int code = pocd::parse_command_line(argc, argv, options);
  if (code >= 0) return code;
  pocd::PipelineConfig config;
  std::unique_ptr<Evaluation> evaluation;
  try {
    pocd::load_config(config, options.config, options.overrides);
    evaluation = std::make_unique<Evaluation>(options, config);
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_evaluate: " << error.what() << '\n';
    return 2;
  }
  try {
    fs::create_directories(options.output);
    const std::vector<pocd::RunScore> runs = evaluation->run();
    for (const pocd::RunScore& run : runs) {
      for (const std::string& problem : run.problems) std::cerr << "skipped: " << problem << '\n';
    }
    write_results(options, config, evaluation->voxels(), runs);
    pocd::print_summary(pocd::summarize(runs), std::cout);
    std::cout << "tables and pictures in " << options.output.string() << '\n';
    return std::cout.flush() ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << "pocd_evaluate: " << error.what() << '\n';
    return 1;
  }
}

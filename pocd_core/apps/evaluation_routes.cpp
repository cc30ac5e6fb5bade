#include "evaluation_routes.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "pocd/common/check.hpp"
#include "pocd/common/natural_order.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

DatasetOptions recordings(DatasetFormat format, const std::vector<fs::path>& inputs) {
  DatasetOptions dataset;
  dataset.format = format;
  dataset.inputs = inputs;
  return dataset;
}

/// What `--sim` may change of a scenario: another camera, another robot's noise.
struct SimChanges {
  double frame_rate_hz;
  CameraModel camera;
  SensorModel sensor;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("frame_rate_hz", frame_rate_hz, Range{0.1, 1000.0}, "Frames of a robot per second.");
    visit("width", camera.width, Range{16, 4096}, "Image width [px].");
    visit("height", camera.height, Range{16, 4096}, "Image height [px].");
    visit("fx", camera.fx, Range{1.0, 1e5}, "Focal length in x [px].");
    visit("fy", camera.fy, Range{1.0, 1e5}, "Focal length in y [px].");
    visit("cx", camera.cx, Range{0.0, 4096.0}, "Principal point in x [px].");
    visit("cy", camera.cy, Range{0.0, 4096.0}, "Principal point in y [px].");
    visit.group("sensor", sensor, "Errors of depth, masks and poses.");
  }
};

/// Counts frames of all runs and says how long the rest takes at the mean speed so far.
class Progress {
 public:
  Progress(std::size_t runs, std::size_t frames)
      : runs_(runs), frames_(frames), shown_(isatty(STDERR_FILENO) != 0), start_(Clock::now()) {}

  void frame() {
    const std::size_t frames = ++frames_done_;
    if (!shown_ || frames % 20 != 0) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    std::fprintf(stderr, "\r\033[K%zu of %zu runs, %s", runs_done_, runs_, rest().c_str());
  }
  void run_done(const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::fprintf(stderr, "%s%zu of %zu: %s, %s\n", shown_ ? "\r\033[K" : "", ++runs_done_, runs_,
                 what.c_str(), rest().c_str());
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::string rest() const {
    const auto done = static_cast<double>(frames_done_.load());
    const double elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
    const double rest_s =
        elapsed_s * std::max(0.0, static_cast<double>(frames_) - done) / std::max(done, 1.0);
    char text[80];
    std::snprintf(text, sizeof(text), "%.1f min gone, about %.1f min left", elapsed_s / 60.0,
                  rest_s / 60.0);
    return text;
  }

  std::size_t runs_, frames_, runs_done_ = 0;
  bool shown_;
  std::atomic<std::size_t> frames_done_{0};
  Clock::time_point start_;
  std::mutex mutex_;
};

}  // namespace

std::vector<std::string> scenario_names(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw InputError(folder.string() + ": no such folder");
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end(), natural_less);
  return names;
}

RouteRunner::RouteRunner(const std::vector<Route>& routes, const RunnerOptions& options)
    : routes_(routes), options_(options) {
  for (const Route& route : routes_) {
    truths_[&route];
    if (options_.dataset) {
      jobs_.push_back(
          {&route, 0, open_dataset(recordings(*options_.dataset, route.files))->size()});
      continue;
    }
    const std::size_t frames = SimSchedule(scenario_of(route)).frames().size();
    for (const std::uint64_t seed : options_.seeds) jobs_.push_back({&route, seed, frames});
  }
}

std::vector<RunScore> RouteRunner::run(const std::vector<MethodSpec>& methods,
                                       const std::function<void(std::size_t, RunScore&)>& done) {
  std::vector<RunScore> scores(jobs_.size());
  std::size_t frames = 0;
  for (const Job& job : jobs_) frames += job.frames;
  Progress progress(jobs_.size(), frames);
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto work = [&] {
    for (std::size_t n = next++; n < jobs_.size(); n = next++) {
      try {
        scores[n] =
            evaluate_run(input_of(jobs_[n]), methods, options_.voxels,
                         options_.config.map.max_depth_m, [&](std::size_t) { progress.frame(); });
        progress.run_done(jobs_[n].route->name + " seed " + std::to_string(jobs_[n].seed));
        const std::lock_guard<std::mutex> lock(mutex);
        if (done) done(n, scores[n]);
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

Scenario RouteRunner::scenario_of(const Route& route) const {
  Scenario scenario = load_run(route.files);
  if (!options_.sensor.empty()) scenario.sensor = load_sensor(options_.sensor);
  SimChanges changes{scenario.frame_rate_hz, scenario.camera, scenario.sensor};
  load_config(changes, {}, options_.sim, "--sim");
  scenario.frame_rate_hz = changes.frame_rate_hz;
  scenario.camera = changes.camera;
  scenario.sensor = changes.sensor;
  return scenario;
}

EvaluationInput RouteRunner::input_of(const Job& job) {
  EvaluationInput input;
  input.route = job.route->name;
  input.seed = job.seed;
  input.with_reference = options_.with_reference;
  input.faults = options_.faults;
  input.faults.seed = job.seed;
  if (options_.dataset) {
    open_recordings(*job.route, input);
    return input;
  }
  const Scenario scenario = scenario_of(*job.route);
  input.truth = truth_of(*job.route, scenario);
  input.visit_begin.assign(input.truth->visit_begin.begin(), input.truth->visit_begin.end() - 1);
  SimReaderOptions reader;
  reader.seed = job.seed;
  reader.with_color = false;
  reader.label_divisor = options_.config.classes.label_divisor;
  input.reader = std::make_unique<SimReader>(scenario, reader);
  return input;
}

void RouteRunner::open_recordings(const Route& route, EvaluationInput& input) const {
  std::uint64_t begin = 0;
  for (const fs::path& file : route.files) {
    input.visit_begin.push_back(begin);
    begin += open_dataset(recordings(*options_.dataset, {file}))->size();
  }
  input.reader = open_dataset(recordings(*options_.dataset, route.files));
}

/// Made once per route, for all its seeds.
std::shared_ptr<const SceneTruth> RouteRunner::truth_of(const Route& route,
                                                        const Scenario& scenario) {
  Truth& truth = truths_.at(&route);
  const std::lock_guard<std::mutex> lock(truth.mutex);
  if (!truth.made) {
    SceneTruthOptions options;
    options.map_voxel_m = options_.config.map.voxel_size_m;
    options.max_depth_m = options_.config.map.max_depth_m;
    truth.made = std::make_shared<SceneTruth>(scene_truth(scenario, options, nullptr));
  }
  return truth.made;
}

}  // namespace pocd

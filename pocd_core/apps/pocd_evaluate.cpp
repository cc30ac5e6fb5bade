// Methods x routes x seeds -> tables and pictures.
#include <iostream>
#include <optional>

#include "evaluate_cli.hpp"
#include "evaluation_methods.hpp"
#include "evaluation_routes.hpp"
#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/eval/evaluation_report.hpp"

namespace {

namespace fs = std::filesystem;

/// Runs that belong together, as a file beside which their paths begin.
struct Suite {
  std::vector<std::string> runs;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit("runs", runs, "Scenario files with several visits, relative to this file.");
  }
};

std::vector<pocd::Route> list_routes(const pocd::EvaluateOptions& o) {
  if (o.dataset) {
    std::string name;
    for (const fs::path& input : o.inputs)
      name += (name.empty() ? "" : "+") + input.filename().string();
    return {{name, o.inputs}};
  }
  std::vector<pocd::Route> routes;
  for (const fs::path& file : o.runs) routes.push_back({file.stem().string(), {file}});
  for (const fs::path& file : o.suites) {
    Suite suite;
    pocd::load_config(suite, {file});
    for (const std::string& run : suite.runs) {
      const fs::path path = (file.parent_path() / run).lexically_normal();
      routes.push_back({path.stem().string(), {path}});
    }
  }
  std::vector<std::string> names = o.names;
  if (names.empty() && routes.empty()) names = pocd::scenario_names(o.scenarios);
  for (const std::string& name : names) {
    routes.push_back({o.baseline + "+" + name,
                      {o.scenarios / (o.baseline + ".yaml"), o.scenarios / (name + ".yaml")}});
  }
  return routes;
}

std::vector<pocd::MethodSpec> list_methods(const pocd::EvaluateOptions& o) {
  std::vector<pocd::Variant> variants;
  for (const pocd::Method method : o.methods) {
    variants.push_back({pocd::word_of(method), method, {}, {}});
  }
  for (const std::string& text : o.variants) variants.push_back(pocd::parse_variant(text));
  for (const fs::path& file : o.variant_files) {
    for (pocd::Variant& variant : pocd::load_variants(file)) variants.push_back(std::move(variant));
  }
  std::vector<pocd::MethodSpec> specs;
  for (const pocd::Variant& variant : variants) {
    specs.push_back(pocd::make_method(variant, {o.config, o.overrides, o.method_config}));
  }
  return specs;
}

/// Pictures of one run, after which what they were made of is dropped.
void draw_run(const pocd::EvaluateOptions& o, double remove_below, double voxel_size_m,
              pocd::RunScore& run) {
  const fs::path folder = o.output / run.route;
  if (o.pictures && (run.seed == o.seeds.front() || o.dataset)) {
    fs::create_directories(folder);
    for (const pocd::MethodScore& m : run.methods) {
      pocd::draw_voxels(m.by_truth ? *m.by_truth : m.by_reference, voxel_size_m,
                        run.route + "  " + m.method + (m.by_truth ? "  against the truth" : ""),
                        folder / ("birdseye_" + m.method + ".png"));
      if (m.histories.empty()) continue;
      pocd::draw_histories(m, remove_below, folder / ("stationarity_" + m.method + ".png"));
    }
  }
  for (pocd::MethodScore& m : run.methods) {
    m.by_reference.voxels.clear();
    if (m.by_truth) m.by_truth->voxels.clear();
    m.histories.clear();
    m.events.clear();
  }
}

void write_tables(const fs::path& output, const std::vector<pocd::RunScore>& runs) {
  pocd::write_markdown(runs, output / "evaluation.md");
  pocd::write_scores_csv(runs, output / "scores.csv");
  pocd::write_changes_csv(runs, output / "changes.csv");
  pocd::write_calibration_csv(pocd::summarize(runs), output / "calibration.csv");
}

int run(const pocd::EvaluateOptions& o, const pocd::PipelineConfig& config,
        pocd::RouteRunner& runner, const std::vector<pocd::MethodSpec>& methods,
        double voxel_size_m) {
  fs::create_directories(o.output);
  // What is done is on disk, should the rest be cut off.
  std::map<std::size_t, pocd::RunScore> finished;
  const std::vector<pocd::RunScore> runs =
      runner.run(methods, [&](std::size_t n, pocd::RunScore& score) {
        for (const std::string& problem : score.problems)
          std::cerr << "skipped: " << problem << '\n';
        draw_run(o, config.state.remove_below, voxel_size_m, score);
        finished[n] = score;
        std::vector<pocd::RunScore> so_far;
        for (const auto& [number, done] : finished) so_far.push_back(done);
        write_tables(o.output, so_far);
      });
  const std::vector<pocd::MethodSummary> summaries = pocd::summarize(runs);
  if (o.pictures) {
    for (const pocd::MethodSummary& summary : summaries) {
      if (summary.calibration.count() == 0) continue;
      pocd::draw_reliability(summary.calibration, summary.method,
                             o.output / ("reliability_" + summary.method + ".png"));
    }
  }
  pocd::print_summary(summaries, std::cout);
  std::cout << "tables and pictures in " << o.output.string() << '\n';
  return std::cout.flush() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  pocd::EvaluateOptions options;
  const int code = pocd::parse_command_line(argc, argv, options);
  if (code >= 0) return code;
  pocd::RunnerOptions run_options;
  std::vector<pocd::MethodSpec> methods;
  std::optional<pocd::RouteRunner> runner;
  try {
    pocd::PipelineConfig& config = run_options.config;
    pocd::load_config(config, options.config, options.overrides);
    run_options.dataset = options.dataset;
    run_options.seeds = options.seeds;
    run_options.faults = options.faults;
    run_options.sensor = options.sensor;
    run_options.sim = options.sim;
    run_options.jobs = options.jobs;
    run_options.with_reference = options.with_reference;
    run_options.voxels.voxel_size_m = options.voxel_size_m;
    run_options.voxels.map_voxel_m = config.map.voxel_size_m;
    run_options.voxels.tolerance_m = config.map.voxel_size_m;
    run_options.voxels.offset_m = config.map.voxel_size_m;
    run_options.voxels.min_height_m = options.min_height_m;
    run_options.voxels.max_height_m = options.max_height_m;
    methods = list_methods(options);
    runner.emplace(list_routes(options), run_options);
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_evaluate: " << error.what() << '\n';
    return 2;
  }
  try {
    return run(options, run_options.config, *runner, methods, run_options.voxels.voxel_size_m);
  } catch (const std::exception& error) {
    std::cerr << "pocd_evaluate: " << error.what() << '\n';
    return 1;
  }
}

// Searches the thresholds of one or more methods on routes kept for that.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>

#include "evaluation_methods.hpp"
#include "evaluation_routes.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/choice_option.hpp"
#include "pocd/common/random.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/eval/evaluation_report.hpp"

namespace {

namespace fs = std::filesystem;

/// One parameter and the values to try, the one it has by default among them.
struct SearchParameter {
  std::string key;
  std::vector<std::string> values;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("key", key, "GROUP.KEY");
    visit("values", values, "Values to try, as text.");
  }
};

struct SearchMethod {
  pocd::Method name = pocd::Method::kPocd;
  int samples = 16;
  std::vector<SearchParameter> parameters;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("name", name, "Method.");
    visit("samples", samples, pocd::Range{1, 10000},
          "Combinations to try beside the defaults; all of them where there are no more.");
    visit("parameters", parameters, "What to search.");
  }
};

struct SearchSpace {
  std::vector<SearchMethod> methods;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("methods", methods, "Methods and their parameters.");
  }
};

/// Every combination where there are few, else as many different ones at random.
std::vector<std::vector<std::string>> combinations(const SearchMethod& method, std::uint64_t seed) {
  double total = 1.0;
  for (const SearchParameter& p : method.parameters) {
    if (p.values.empty()) {
      throw pocd::InputError(word_of(method.name) + ": " + p.key + " has no values");
    }
    total *= static_cast<double>(p.values.size());
  }
  const auto named = [&](std::uint64_t number) {
    std::vector<std::string> set;
    for (const SearchParameter& p : method.parameters) {
      set.push_back(p.key + "=" + p.values[number % p.values.size()]);
      number /= p.values.size();
    }
    return set;
  };
  std::vector<std::vector<std::string>> out;
  if (total <= method.samples) {
    for (std::uint64_t n = 0; n < static_cast<std::uint64_t>(total); ++n) out.push_back(named(n));
    return out;
  }
  pocd::Random random(seed);
  while (out.size() < static_cast<std::size_t>(method.samples)) {
    const auto set = named(random.below(static_cast<std::uint64_t>(total)));
    if (std::find(out.begin(), out.end(), set) == out.end()) out.push_back(set);
  }
  return out;
}

struct Candidate {
  std::string method, parameters;
  double objective = 0.0;
  pocd::MethodSummary summary;
};

/// Harmonic mean of precision and recall against the truth, mean over runs, in percent.
double objective_of(const std::vector<pocd::RunScore>& runs, std::size_t method) {
  double sum = 0.0;
  for (const pocd::RunScore& run : runs) {
    const double p = run.methods[method].by_truth->precision();
    const double r = run.methods[method].by_truth->recall();
    if (p > 0.0 && r > 0.0) sum += 2.0 * p * r / (p + r);
  }
  return sum / static_cast<double>(runs.size());
}

void write_candidates(const std::vector<Candidate>& candidates, const fs::path& file) {
  std::ofstream out(file, std::ios::binary);
  out << "method,objective,precision,recall,fpr,parameters\n";
  for (const Candidate& c : candidates) {
    char numbers[120];
    std::snprintf(numbers, sizeof(numbers), "%.3f,%.3f,%.3f,%.3f", c.objective,
                  c.summary.truth_precision, c.summary.truth_recall, c.summary.truth_fpr);
    out << c.method << ',' << numbers << ',' << c.parameters << '\n';
  }
  out.close();
  if (!out) throw pocd::InputError(file.string() + ": cannot be written in full");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Searches thresholds of methods by the harmonic mean of precision and recall against the "
      "truth, over routes and seeds that no reported table uses. All candidates see the same "
      "frames.\n"
      "Example: pocd_tune --space config/evaluation/tuning.yaml --config config/simulated.yaml "
      "--run config/sim/training/depot.yaml --seeds 101,102 --output output/tuning\n"
      "Exit code: 0 done, 1 inputs or outputs unusable, 2 usage or configuration.",
      "pocd_tune");
  app.set_version_flag("--version", POCD_VERSION);
  fs::path space_file = "config/evaluation/tuning.yaml", output;
  std::vector<fs::path> runs, config;
  std::vector<pocd::Method> only;
  pocd::RunnerOptions options;
  options.with_reference = false;
  options.seeds = {101};
  std::uint64_t search_seed = 1;
  app.add_option("--space", space_file, "Methods, parameters and values")->capture_default_str();
  app.add_option("--run", runs, "Scenario file with several visits")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--config", config, "Configuration file; repeat it to overlay several")
      ->required()
      ->allow_extra_args(false);
  pocd::add_choices(app, "--methods", only, "Of the space, these only");
  app.add_option("--seeds", options.seeds, "Seeds of the simulator's noise")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--search-seed", search_seed, "Seed of the random search")->capture_default_str();
  app.add_option("--jobs", options.jobs, "Routes at the same time")->check(CLI::Range(1, 64));
  app.add_option("--output", output, "Folder for candidates.csv, made if missing")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  std::vector<pocd::MethodSpec> specs;
  std::vector<Candidate> candidates;
  std::vector<pocd::Route> routes;
  try {
    SearchSpace space;
    pocd::load_config(space, {space_file});
    pocd::load_config(options.config, config);
    options.voxels.map_voxel_m = options.voxels.tolerance_m = options.voxels.offset_m =
        options.config.map.voxel_size_m;
    for (const fs::path& file : runs) routes.push_back({file.stem().string(), {file}});
    for (const SearchMethod& method : space.methods) {
      if (!only.empty() && std::find(only.begin(), only.end(), method.name) == only.end()) continue;
      std::vector<std::vector<std::string>> sets = combinations(method, search_seed);
      sets.insert(sets.begin(), std::vector<std::string>());  // the defaults
      for (const auto& set : sets) {
        std::string text;
        for (const std::string& one : set) text += (text.empty() ? "" : " ") + one;
        const std::string name = word_of(method.name);
        candidates.push_back({name, set.empty() ? "defaults" : text, 0.0, {}});
        specs.push_back(pocd::make_method({name, method.name, {}, set}, {config, {}, {}}));
      }
    }
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_tune: " << error.what() << '\n';
    return 2;
  }
  try {
    fs::create_directories(output);
    pocd::RouteRunner runner(routes, options);
    const std::vector<pocd::RunScore> scores =
        runner.run(specs, [](std::size_t, pocd::RunScore& run) {
          for (pocd::MethodScore& m : run.methods) m.histories.clear(), m.events.clear();
        });
    const std::vector<pocd::MethodSummary> summaries = pocd::summarize(scores);
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      candidates[c].objective = objective_of(scores, c);
      candidates[c].summary = summaries[c];
    }
    std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
      return a.method != b.method ? a.method < b.method : a.objective > b.objective;
    });
    write_candidates(candidates, output / "candidates.csv");
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const Candidate& best = candidates[c];
      const bool first = c == 0 || candidates[c - 1].method != best.method;
      if (!first && best.parameters != "defaults") continue;
      std::printf("%-18s F %.2f  P %.1f  R %.1f  FPR %.2f  %s\n", best.method.c_str(),
                  best.objective, best.summary.truth_precision, best.summary.truth_recall,
                  best.summary.truth_fpr, best.parameters.c_str());
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "pocd_tune: " << error.what() << '\n';
    return 1;
  }
}

// pocd_benchmark: the suites of whole frames and, on request, Google Benchmark's loops.
#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <sstream>

#include "peers.hpp"
#include "pocd/common/check.hpp"
#include "suites.hpp"

namespace pocd::bench {
namespace {

struct Options {
  std::vector<std::string> suites{"integration", "pipeline", "icp", "loops"};
  std::vector<std::string> sets{"redkitchen", "tabletop_states", "circuit", "exact_circuit"};
  std::size_t frames = 300;
  SuiteOptions suite;
  std::string output;
  std::string filter = ".";
};

bool has(const std::vector<std::string>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

std::string machine() {
  std::ifstream info("/proc/cpuinfo"), load("/proc/loadavg");
  std::string line, model = "unknown processor", average;
  while (std::getline(info, line)) {
    if (line.rfind("model name", 0) == 0) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  }
  load >> average;
  return model + ", load average at the start " + average;
}

void run_sets(const Options& options, std::ostream& out) {
  using Load = FrameSet (*)(std::size_t);
  const std::vector<std::pair<std::string, Load>> all{{"redkitchen", load_redkitchen},
                                                      {"tabletop_states", load_tabletop},
                                                      {"circuit", load_circuit},
                                                      {"exact_circuit", load_exact_circuit}};
  for (const auto& [name, load] : all) {
    if (!has(options.sets, name)) continue;
    const FrameSet set = load(options.frames);
    if (set.frames.empty()) {
      out << name << ": skipped, " << set.missing << "\n\n";
      continue;
    }
    // The table top is one view of 1 cm voxels: nothing for the comparison of whole maps.
    if (has(options.suites, "integration") && name != "tabletop_states" && HashTsdf::available()) {
      run_integration(set, options.suite, out);
    }
    // Exact frames are for the error of the surfaces.
    if (has(options.suites, "pipeline") && name != "exact_circuit") {
      run_pipeline(set, options.suite, out);
    }
  }
}

void run_loops(const Options& options) {
  std::string program = "pocd_benchmark", filter = "--benchmark_filter=" + options.filter;
  char* arguments[] = {program.data(), filter.data(), nullptr};
  int count = 2;
  benchmark::Initialize(&count, arguments);
  benchmark::RunSpecifiedBenchmarks();
}

int run(const Options& options) {
  std::ostringstream tables;
  tables << "Machine: " << machine() << ".\n\n";
  run_sets(options, tables);
  if (has(options.suites, "icp")) run_icp(options.suite, tables);
  std::cout << tables.str() << std::flush;
  if (!options.output.empty()) {
    std::ofstream file(options.output);
    if (!(file << tables.str() << std::flush)) {
      throw InputError("cannot write " + options.output);
    }
  }
  if (has(options.suites, "loops")) run_loops(options);
  return 0;
}

}  // namespace
}  // namespace pocd::bench

int main(int argc, char** argv) {
  pocd::bench::Options options;
  CLI::App app{
      "Measures the component's stages beside those of other libraries, on the same frames in "
      "turns.\nExample: pocd_benchmark --suite pipeline --set redkitchen --output table.md"};
  app.add_option("--suite", options.suites, "What to measure; repeat it for several")
      ->check(CLI::IsMember({"integration", "pipeline", "icp", "loops"}));
  app.add_option("--set", options.sets, "Frames to measure on; repeat it for several")
      ->check(CLI::IsMember({"redkitchen", "tabletop_states", "circuit", "exact_circuit"}));
  app.add_option("--frames", options.frames, "At most that many frames of each set")
      ->capture_default_str();
  app.add_option("--passes", options.suite.passes,
                 "Runs from the beginning; the faster time of each frame counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--filter", options.filter, "Names of the loops of Google Benchmark")
      ->capture_default_str();
  app.add_option("--output", options.output, "File for the tables, markdown");
  CLI11_PARSE(app, argc, argv);
  try {
    return pocd::bench::run(options);
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_benchmark: " << error.what() << "\n";
    return 1;
  }
}

// Command line of pocd_evaluate.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "evaluation_methods.hpp"
#include "pocd/datasets/open_dataset.hpp"
#include "pocd/eval/fault_injection.hpp"

namespace pocd {

struct EvaluateOptions {
  std::filesystem::path scenarios = "config/sim/torwic";
  std::string baseline = "0";
  std::vector<std::string> names;             ///< empty: every scenario of the folder
  std::vector<std::filesystem::path> runs;    ///< scenario files with several visits
  std::vector<std::filesystem::path> suites;  ///< files that list such
  std::optional<DatasetFormat> dataset;       ///< recordings instead: their format
  std::vector<std::filesystem::path> inputs;
  std::vector<Method> methods;
  std::vector<std::string> variants;  ///< NAME=FILE or NAME=GROUP.KEY=VALUE,...
  std::vector<std::filesystem::path> variant_files;
  std::vector<std::uint64_t> seeds = {1, 2, 3};
  FaultOptions faults;
  std::filesystem::path sensor;  ///< model for every simulated scenario; empty: its own
  std::vector<std::string> sim;
  std::vector<std::filesystem::path> config;
  std::vector<std::string> overrides;
  std::vector<std::filesystem::path> method_config;
  std::filesystem::path output;
  int jobs = 1;
  bool quick = false;
  bool pictures = true;
  bool with_reference = true;
  double voxel_size_m = 0.2;
  double min_height_m = 0.1, max_height_m = 4.0;
};

/// Exit code to end with, or -1 to go on.
int parse_command_line(int argc, char** argv, EvaluateOptions& options);

}  // namespace pocd

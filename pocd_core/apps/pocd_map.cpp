// The offline command: frames from files, no bus, the same bytes out for the same bytes in.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>

#include "map_run.hpp"
#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/datasets/dataset_options_cli.hpp"
#include "pocd/config/node_config.hpp"

namespace {

volatile std::sig_atomic_t stop_requested = 0;

/// The first signal asks for an orderly end, a second one ends the process as usual.
void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

void print(const pocd::RunSummary& s, const std::filesystem::path& output) {
  std::cout << s.frames << " frames" << (s.stopped_early ? " (stopped early)" : "") << ", "
            << s.skipped << " skipped, " << s.refused << " refused; " << s.objects << " objects; "
            << s.added << " added, " << s.moved << " moved, " << s.removed << " removed; map "
            << s.map_digest << "\nresults in " << output.string() << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Maps a recorded or simulated data set and lists what changed.\n"
      "Example: pocd_map --dataset sim --input config/sim/demo.yaml --config config/simulated.yaml "
      "--output output/demo\n"
      "Exit code: 0 done (bad frames are skipped and counted), 1 inputs or outputs unusable, 2 "
      "usage or configuration.",
      "pocd_map");
  pocd::MapRunOptions options;
  std::vector<std::filesystem::path> files;
  std::vector<std::string> overrides, robots;
  app.set_version_flag("--version", POCD_VERSION);
  pocd::add_dataset_options(app, options.dataset);
  pocd::add_topic_options(app, overrides);
  app.add_option("--config", files, "Configuration file; repeat it to overlay several")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--set", overrides, "Override one parameter: GROUP.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--robot", robots,
                 "A robot of a recording, as for pocd_node; default: all; repeat it")
      ->allow_extra_args(false);
  app.add_option_function<std::string>(
      "--threads", [&](const std::string& n) { overrides.push_back("threads=" + n); },
      "Threads; results do not depend on it");
  app.add_option(
      "--network", options.network,
      "ONNX model, with its description beside it (docs/segmentation.md), that makes the "
      "masks from the colour images; masks of the inputs are not used");
  app.add_option("--output", options.output, "Folder for the results, made if missing")->required();
  app.add_option("--max-frames", options.max_frames, "Stop after that many good frames")
      ->check(CLI::Range(1, 1000000000));
  app.add_option("--memory", options.memory.config.folder,
                 "Folder that keeps what is known: the run goes on from what it holds and leaves "
                 "there what it knows");
  app.add_flag("--resume", options.memory.resume,
               "The inputs are those of the run that was ended before its time: frames that are in "
               "the memory are not taken again");
  app.add_option("--memory-period", options.memory.config.period_s,
                 "Least time between two steps that are kept [s]")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (options.memory.resume && !options.memory.config.on()) {
    std::cerr << "pocd_map: --resume needs --memory\n";
    return 2;
  }
  try {
    pocd::NodeFile file;
    pocd::load_config(file, files, overrides);
    file.node.set_robots(robots);
    options.config = file.pipeline;
    options.dataset.input = file.node;
    if (!options.network.empty()) options.dataset.input.use_color_alone();
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_map: " << error.what() << '\n';
    return 2;
  }
  try {
    stop_on_signals();
    options.stop = &stop_requested;
    options.show_progress = isatty(STDERR_FILENO) != 0;
    options.dataset.label_divisor = options.config.classes.label_divisor;
    options.dataset.classes = options.config.classes;
    options.dataset.max_depth_m = options.config.map.max_depth_m;
    print(pocd::run_map(options, std::cerr), options.output);
    return std::cout.flush() ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << "pocd_map: " << error.what() << '\n';
    return 1;
  }
}

// A segmentation network on the bus: colour images in, class masks out.
#include "pocd_dds/segment/segmenter.hpp"

#include <algorithm>

#include "apps/common.hpp"
#include "pocd/config/config_io.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Makes class masks from robots' colour images with an ONNX network.\n"
      "Example: pocd_segment --config config/torwic.yaml --network deploy_model.onnx --robot "
      "robot1\n"
      "Beside the model, a file with its name and .yaml describes it (docs/segmentation.md). "
      "Topics, robots and classes are those of the node: give it the same --config.\n"
      "Exit code: 0 ended in order, 1 the bus or the network cannot be used, 2 usage or "
      "configuration.",
      "pocd_segment");
  pocd::dds::SegmenterOptions options;
  options.bus.name = "pocd_segment";
  std::filesystem::path network;
  std::vector<std::filesystem::path> files;
  std::vector<std::string> overrides, robots;
  int threads = 1, domain = -1;
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("--network", network, "Model (ONNX)")->required();
  app.add_option("--config", files, "Configuration file of the node; repeat it to overlay several")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--set", overrides, "Override one parameter: GROUP.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--robot", robots,
                 "A robot, {robot} in the topics; default: all that appear; repeat it for several")
      ->allow_extra_args(false);
  app.add_option("--threads", threads, "Threads that the network may use")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_flag("--lossless", options.lossless,
               "Hold the senders back instead of dropping images (replays)");
  pocd::dds::add_bus_options(app, domain, options.bus.profiles_file, options.bus.security_folder);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  pocd::NodeFile file;
  try {
    pocd::load_config(file, files, overrides);
    file.node.set_robots(robots);
    options.input = file.node;
    options.bus.domain = domain >= 0 ? domain : pocd::dds::default_domain();
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_segment: " << error.what() << '\n';
    return 2;
  }
  return pocd::dds::guarded("pocd_segment", [&] {
    pocd::dds::log_to_stderr("pocd_segment");
    pocd::dds::stop_on_signals();
    pocd::dds::Segmenter segmenter(options, std::make_shared<pocd::SegmentationNetwork>(
                                                network, file.pipeline.classes, threads));
    spdlog::info("running on domain {}", options.bus.domain);
    const pocd::dds::SegmenterCounts counts = segmenter.run(pocd::dds::stop_requested);
    std::cout << counts.masks << " masks sent of " << counts.images << " images, " << counts.dropped
              << " dropped, " << counts.refused << " refused; "
              << 1e3 * counts.busy_s / static_cast<double>(std::max<std::uint64_t>(1, counts.masks))
              << " ms per mask\n";
    return std::cout.flush() ? 0 : 1;
  });
}

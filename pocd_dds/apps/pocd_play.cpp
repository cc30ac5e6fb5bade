// A data set or the simulator on the bus, as robots with cameras would send it.
#include <set>

#include "apps/common.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/config/node_config.hpp"
#include "pocd/datasets/dataset_options_cli.hpp"
#include "pocd/network/segmentation_network.hpp"
#include "pocd_dds/play/player.hpp"
#include "pocd_dds/recording/replayer.hpp"

namespace {

using pocd::dds::ReplayOptions;

/// Adds the flags that only concern recordings; all of them refuse to stand without FILE.
void add_replay_options(CLI::App& app, ReplayOptions& replay, std::vector<std::string>& remap) {
  CLI::Option* files =
      app.add_option("FILE", replay.inputs, "Recordings to play: MCAP, .db3, or folders");
  const auto add = [&](CLI::Option* option) {
    option->needs(files)->group("Recordings");
    return option;
  };
  add(app.add_option("--topics", replay.topics,
                     "Pattern of topics to play; default: all; repeat it"))
      ->allow_extra_args(false);
  add(app.add_option("--latch", replay.latch,
                     "Pattern of topics to play latched, whatever the recording says; repeat it"))
      ->allow_extra_args(false);
  add(app.add_option("--no-latch", replay.no_latch, "Pattern of topics not to play latched"))
      ->allow_extra_args(false);
  add(app.add_option("--remap", remap, "FROM=TO: play a topic under another name; repeat it"))
      ->allow_extra_args(false);
  add(app.add_option("--start", replay.start_s, "Seconds after the beginning to start at"))
      ->check(CLI::Range(0.0, 1e9));
  add(app.add_option("--duration", replay.duration_s, "Seconds of the recording to play"))
      ->check(CLI::Range(0.0, 1e9));
  add(app.add_flag("--loop", replay.loop,
                   "Begin again at the end, as a new source: a node goes on with its map"));
  add(app.add_option("--readers", replay.readers, "Readers that each topic waited for needs"))
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  add(app.add_option("--wait-for", replay.wait_for,
                     "Pattern of topics whose readers are waited for; default: depth images"))
      ->allow_extra_args(false);
}

/// Refuses what only concerns data sets. Throws CLI::ValidationError.
void check_recording_flags(const CLI::App& app) {
  static const std::set<std::string> both{"--speed",   "--fast",   "--lossless", "--clock",
                                          "--no-wait", "--domain", "--profiles", "--rate"};
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || option->get_group() == "Recordings" || both.count(name) > 0 ||
        option->get_positional()) {
      continue;
    }
    throw CLI::ValidationError(name, "is for data sets, not for recordings");
  }
  if (app.count("--rate") > 0 && app.count("--speed") + app.count("--fast") > 0) {
    throw CLI::ValidationError("--rate", "is --speed for recordings; give one of them");
  }
}

/// Throws CLI::ValidationError.
void set_remap(const std::vector<std::string>& remap, ReplayOptions& replay) {
  for (const std::string& text : remap) {
    const std::size_t at = text.find('=');
    if (at == std::string::npos || at == 0 || at + 1 == text.size()) {
      throw CLI::ValidationError("--remap", "\"" + text + "\" is not FROM=TO");
    }
    replay.remap[text.substr(0, at)] = text.substr(at + 1);
  }
}

int replay_recordings(const ReplayOptions& options) {
  pocd::dds::Replayer replayer(options);
  const pocd::dds::ReplayResult result = replayer.run(pocd::dds::stop_requested);
  std::cout << result.messages << " messages and " << result.instance_changes
            << " instance changes sent, " << result.problems << " problems in the recording"
            << (result.stopped ? ", stopped early" : "") << '\n';
  if (!result.acknowledged) spdlog::error("readers did not acknowledge everything in time");
  const bool good = (result.acknowledged || result.stopped) && result.failures == 0;
  return std::cout.flush() && good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Publishes a data set, the simulator or a recording on the bus, once its topics have "
      "readers.\n"
      "Examples: pocd_play --dataset sim --input config/sim/demo.yaml --speed 2\n"
      "          pocd_play run.mcap --rate 10 --topics '/robot_*' --topics '/tf*'\n"
      "Topics per robot of a data set: rt/ROBOT/depth/image_raw, depth/camera_info, segmentation, "
      "color/image_raw, odom; and rt/tf_static.\n"
      "Exit code: 0 everything sent and acknowledged, 1 not, 2 usage.",
      "pocd_play");
  pocd::dds::PlayOptions options;
  pocd::DatasetOptions dataset;
  std::filesystem::path network;
  std::vector<std::filesystem::path> files;
  options.bus.name = "pocd_play";
  double speed = 1.0;
  bool fast = false, no_wait = false;
  app.set_version_flag("--version", POCD_VERSION);
  std::vector<std::string> input_settings;
  pocd::add_dataset_options(app, dataset);
  pocd::add_topic_options(app, input_settings);
  app.get_option("--dataset")->required(false);
  app.get_option("--input")->required(false);
  app.get_option("--rate")->description(
      "Frames per second of inputs without stamps; of recordings, the multiple of their own speed");
  ReplayOptions replay;
  std::vector<std::string> remap;
  add_replay_options(app, replay, remap);
  app.add_option("--robot", options.robot, "Name of the robot, for sources that name none")
      ->capture_default_str();
  app.add_option("--speed", speed, "Multiple of the source's own speed")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  app.add_flag("--fast", fast, "As fast as frames can be made, and acknowledged with --lossless")
      ->excludes("--speed");
  app.add_flag("--lossless", options.lossless,
               "Send a frame only when the one before is acknowledged (the node needs --lossless, "
               "too, or it only hears what it has time for)");
  app.add_flag("--clock", options.clock, "Publish rt/clock");
  app.add_flag("--no-wait", no_wait, "Do not wait for readers");
  app.add_flag("!--no-color", dataset.with_color, "No colour images");
  CLI::Option* config = app.add_option("--config", files,
                                       "Configuration file whose classes.list has the ids of the "
                                       "network's classes; repeat it to overlay several")
                            ->allow_extra_args(false);
  app.add_option(
         "--network", network,
         "ONNX model, with its description beside it (docs/segmentation.md), that makes the "
         "masks from the colour images")
      ->needs(config);
  app.add_option("--max-frames", options.max_frames, "Stop after that many good frames")
      ->check(CLI::Range(1, 1000000000));
  app.add_option("--map-frame", options.map_frame, "Frame that the poses are in")
      ->capture_default_str();
  int domain = -1;
  pocd::dds::add_bus_options(app, domain, options.bus.profiles_file, options.bus.security_folder);
  try {
    app.parse(argc, argv);
    const bool has_dataset = app.count("--dataset") > 0 && app.count("--input") > 0;
    if (has_dataset == !replay.inputs.empty()) {
      throw CLI::ValidationError("give either --dataset and --input, or recordings");
    }
    if (!has_dataset) check_recording_flags(app);
    set_remap(remap, replay);
    // For recordings, --rate is the multiple of the original speed that it is with rosbag2.
    if (!has_dataset && app.count("--rate") > 0) speed = dataset.frame_rate_hz;
    pocd::NodeFile file;
    pocd::load_config(file, files, input_settings);
    dataset.input = file.node;
    dataset.classes = file.pipeline.classes;
    if (dataset.with_color) dataset.input.color = pocd::StreamUse::kOptional;
    if (!network.empty()) dataset.input.use_color_alone();
    options.bus.domain = domain >= 0 ? domain : pocd::dds::default_domain();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_play: " << error.what() << '\n';
    return 2;
  }
  return pocd::dds::guarded("pocd_play", [&] {
    pocd::dds::log_to_stderr("pocd_play");
    pocd::dds::stop_on_signals();
    options.wait_for_readers = !no_wait;
    if (fast) {
      options.speed.reset();
    } else {
      options.speed = speed;
    }
    if (!replay.inputs.empty()) {
      replay.bus = options.bus;
      replay.speed = options.speed;
      replay.lossless = options.lossless;
      replay.clock = options.clock;
      replay.wait_for_readers = options.wait_for_readers;
      replay.keyboard = true;
      return replay_recordings(replay);
    }
    std::unique_ptr<pocd::DatasetReader> reader = pocd::open_dataset(dataset);
    if (!network.empty()) {
      reader = pocd::segmented(std::move(reader), std::make_shared<pocd::SegmentationNetwork>(
                                                      network, dataset.classes, 1));
    }
    pocd::dds::Player player(options, std::move(reader));
    const pocd::dds::PlayResult result = player.run(pocd::dds::stop_requested);
    std::cout << result.frames << " frames sent, " << result.skipped << " skipped"
              << (result.stopped ? ", stopped early" : "") << '\n';
    if (!result.acknowledged && !result.stopped) {
      spdlog::error("readers did not acknowledge everything in time");
      return 1;
    }
    return std::cout.flush() ? 0 : 1;
  });
}

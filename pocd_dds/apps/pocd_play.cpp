// A data set or the simulator on the bus, as robots with cameras would send it.
#include "apps/common.hpp"
#include "pocd/config/dataset_options_cli.hpp"
#include "pocd_dds/play/player.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Publishes a data set or the simulator on the bus, once its topics have readers.\n"
      "Example: pocd_play --dataset sim --input config/sim/demo.yaml --speed 2\n"
      "Topics per robot: rt/ROBOT/depth/image_raw, depth/camera_info, segmentation, "
      "color/image_raw, odom; and rt/tf_static.\n"
      "Exit code: 0 everything sent and acknowledged, 1 not, 2 usage.",
      "pocd_play");
  pocd::dds::PlayOptions options;
  options.bus.name = "pocd_play";
  double speed = 1.0;
  bool fast = false, no_wait = false;
  app.set_version_flag("--version", POCD_VERSION);
  pocd::add_dataset_options(app, options.dataset);
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
  app.add_flag("!--no-color", options.dataset.with_color, "No colour images");
  app.add_option("--max-frames", options.max_frames, "Stop after that many good frames")
      ->check(CLI::Range(1, 1000000000));
  app.add_option("--map-frame", options.map_frame, "Frame that the poses are in")
      ->capture_default_str();
  int domain = -1;
  pocd::dds::add_bus_options(app, domain, options.bus.profiles_file);
  try {
    app.parse(argc, argv);
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
    pocd::dds::Player player(options);
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

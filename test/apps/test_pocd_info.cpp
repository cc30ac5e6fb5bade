// pocd_info --suggest: a configuration with which pocd_map makes frames of the recording.
#include <gtest/gtest.h>

#include "recorded_run.hpp"
#include "run_command.hpp"

namespace pocd::recording {
namespace {

CommandResult run(const std::string& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), std::string(POCD_BIN_DIR) + "/" + program);
  return run_command(arguments);
}

TEST(PocdInfo, SuggestsAConfigurationThatFits) {
  const TemporaryFolder folder;
  const std::string file = (folder / "in.mcap").string();
  {
    McapWriter writer(file);
    const auto channel = [&](const char* topic, const char* type) {
      return writer.add_channel(writer.add_schema(type, "ros2msg", ""), topic, "cdr", {});
    };
    const auto depth = channel("/fleet/a/depth/image_rect", "sensor_msgs/msg/Image"),
               info = channel("/fleet/a/depth/camera_info", "sensor_msgs/msg/CameraInfo"),
               odometry = channel("/odometry", "nav_msgs/msg/Odometry");
    for (StampNs t = kPeriod; t < 10 * kPeriod; t += kPeriod) {
      const auto write = [&](std::uint16_t to, const Bytes& payload) {
        writer.write({to, 0, static_cast<std::uint64_t>(t), 0}, payload.data(), payload.size());
      };
      const cv::Mat image(6, 8, CV_16UC1, cv::Scalar(1500));
      write(odometry, odometry_payload(t, "map", "camera", {}));
      write(info, camera_info_payload(t, "camera", kCamera));
      write(depth, image_payload(t, "camera", "16UC1", image));
    }
    writer.close();
  }
  const CommandResult suggested = run("pocd_info", {"--suggest", file});
  ASSERT_EQ(suggested.exit_code, 0) << suggested.err;
  const std::string config = (folder / "robot.yaml").string();
  std::ofstream(config) << suggested.out;
  const CommandResult mapped = run("pocd_map", {"--dataset", "mcap", "--input", file, "--config",
                                                config, "--output", (folder / "out").string()});
  EXPECT_EQ(mapped.exit_code, 0) << mapped.err << suggested.out;
  EXPECT_EQ(mapped.out.find("9 frames, 0 skipped"), 0u) << mapped.out << mapped.err;
}

TEST(PocdInfo, SaysWhenThereIsNothingToSuggest) {
  const TemporaryFolder folder;
  McapWriter writer(folder / "in.mcap");
  writer.close();
  const CommandResult result = run("pocd_info", {"--suggest", (folder / "in.mcap").string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "pocd_info: no depth images: there is no topic at all\n");
}

}  // namespace
}  // namespace pocd::recording

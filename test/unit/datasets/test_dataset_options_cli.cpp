#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "pocd/datasets/dataset_options_cli.hpp"

namespace pocd {
namespace {

DatasetOptions parse(const std::string& arguments) {
  CLI::App app;
  DatasetOptions options;
  add_dataset_options(app, options);
  app.parse(arguments);
  return options;
}

TEST(DatasetOptionsCli, DefaultsAreThoseOfTheStruct) {
  const DatasetOptions parsed = parse("--dataset rgbd --input a");
  const DatasetOptions defaults;
  EXPECT_EQ(parsed.format, DatasetFormat::kRgbd);
  EXPECT_EQ(parsed.inputs, std::vector<std::filesystem::path>{"a"});
  EXPECT_EQ(parsed.repeat, defaults.repeat);
  EXPECT_EQ(parsed.frame_rate_hz, defaults.frame_rate_hz);
  EXPECT_EQ(parsed.gravity_W, defaults.gravity_W);
  EXPECT_EQ(parsed.seed, defaults.seed);
}

TEST(DatasetOptionsCli, ReadsAllFlags) {
  const DatasetOptions parsed = parse(
      "--dataset pcd --input b --input a --repeat 10 --rate 5 --gravity=-0.00887,0.90443,0.42654 "
      "--seed 18446744073709551615 --camera 640,480,525,525,319.5,239.5 --sensor perfect "
      "--camera-pose 0.1,-0.5,2,0,0,0.6,0.8 --mount 1,2,3,0,0,0,1");
  EXPECT_EQ(parsed.inputs, (std::vector<std::filesystem::path>{"b", "a"}));
  EXPECT_EQ(parsed.repeat, 10);
  EXPECT_EQ(parsed.frame_rate_hz, 5.0);
  EXPECT_EQ(parsed.seed, 18446744073709551615ull);
  EXPECT_NEAR(parsed.gravity_W.value().norm(), 1.0, 1e-12);  // rounding of one division
  EXPECT_NEAR(parsed.gravity_W.value().y(), 0.90443, 1e-4);  // the text's digits
  EXPECT_EQ(parsed.camera.value(), (CameraModel{640, 480, 525, 525, 319.5, 239.5}));
  EXPECT_EQ(parsed.sensor, SensorKind::kPerfect);
  EXPECT_EQ(parsed.T_W_C.value().translation(), Eigen::Vector3d(0.1, -0.5, 2));
  // Half the angle has sine 0.6: the x axis turns to (cos, sin) = (0.28, 0.96). Rounding only.
  EXPECT_TRUE(parsed.T_W_C.value().linear().col(0).isApprox(Eigen::Vector3d(0.28, 0.96, 0), 1e-12));
  EXPECT_EQ(parsed.extrinsics.value().T_B_C.translation(), Eigen::Vector3d(1, 2, 3));
}

TEST(DatasetOptionsCli, RefusesWordsThatAreNoChoice) {
  EXPECT_THROW(parse("--dataset rosbag --input a"), CLI::ValidationError);
  EXPECT_THROW(parse("--dataset sim --input a --sensor lidar"), CLI::ValidationError);
}

// Without quotes YAML would take it for a group of keys.
TEST(DatasetOptionsCli, ATopicMayBeginWithTheRobot) {
  CLI::App app;
  std::vector<std::string> overrides;
  add_topic_options(app, overrides);
  app.parse("--depth-topic {robot}/depth");
  EXPECT_EQ(overrides, (std::vector<std::string>{"node.topics.depth=\"{robot}/depth\""}));
}

TEST(DatasetOptionsCli, RefusesWhatIsNoDirection) {
  const std::string input = "--dataset rgbd --input a --gravity=";
  for (const char* bad : {"0,0", "0,0,-9.81", "0,0,0", "0,0,nan", "a,b,c", "0,0,-1,", "0,0,-1,0"}) {
    EXPECT_THROW(parse(input + bad), CLI::ParseError) << bad;
  }
}

TEST(DatasetOptionsCli, RefusesWhatIsNoCameraAndNoPose) {
  const std::string input = "--dataset pcd --input a ";
  for (const char* bad : {"--camera 640,480,525,525,319.5", "--camera 640,480,0,525,319.5,239.5",
                          "--camera 640.5,480,525,525,319.5,239.5", "--camera 1e9,1,1,1,1,1",
                          "--camera-pose 0,0,0,0,0,0", "--camera-pose 0,0,0,0,0,0,0",
                          "--mount 0,0,0,1,1,1,1", "--mount 0,0,inf,0,0,0,1", "--sensor lidar"}) {
    EXPECT_THROW(parse(input + bad), CLI::ParseError) << bad;
  }
}

TEST(DatasetOptionsCli, RefusesMissingAndOutOfRange) {
  EXPECT_THROW(parse("--input a"), CLI::ParseError);
  EXPECT_THROW(parse("--dataset rgbd"), CLI::ParseError);
  EXPECT_THROW(parse("--dataset rgbd --input a --repeat 0"), CLI::ParseError);
  EXPECT_THROW(parse("--dataset rgbd --input a --rate 0"), CLI::ParseError);
  EXPECT_THROW(parse("--dataset rgbd --input a --seed -1"), CLI::ParseError);
}

}  // namespace
}  // namespace pocd

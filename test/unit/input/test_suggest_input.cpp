// What is suggested for the topics that drivers announce.
#include "pocd/input/suggest_input.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "pocd/config/config_io.hpp"
#include "pocd/config/node_config.hpp"
#include "pocd/input/input_topics.hpp"

namespace pocd {
namespace {

constexpr char kImage[] = "sensor_msgs/msg/Image";
constexpr char kCompressed[] = "sensor_msgs/msg/CompressedImage";
constexpr char kInfo[] = "sensor_msgs/msg/CameraInfo";
constexpr char kOdometry[] = "nav_msgs/msg/Odometry";
constexpr char kTf[] = "tf2_msgs/msg/TFMessage";

struct Camera {
  const char* name;
  const char* file;  // its configuration without and with namespace
  std::vector<TopicInfo> topics;
  std::string depth, info;
};

std::vector<Camera> cameras() {
  return {{"realsense",
           "realsense",
           {{"rt/camera/camera/depth/image_rect_raw", kImage},
            {"rt/camera/camera/depth/camera_info", kInfo},
            {"rt/camera/camera/aligned_depth_to_color/image_raw", kImage},
            {"rt/camera/camera/aligned_depth_to_color/image_raw/compressedDepth", kCompressed},
            {"rt/camera/camera/aligned_depth_to_color/camera_info", kInfo},
            {"rt/camera/camera/infra1/image_rect_raw", kImage},
            {"rt/camera/camera/color/image_raw", kImage},
            {"rt/camera/camera/color/camera_info", kInfo}},
           "rt/camera/camera/aligned_depth_to_color/image_raw",
           "rt/camera/camera/aligned_depth_to_color/camera_info"},
          {"zed",
           "zed",
           {{"rt/zed/zed_node/depth/depth_registered", kImage},
            {"rt/zed/zed_node/depth/camera_info", kInfo},
            {"rt/zed/zed_node/confidence/confidence_map", kImage},
            {"rt/zed/zed_node/rgb/image_rect_color", kImage},
            {"rt/zed/zed_node/rgb/camera_info", kInfo},
            {"rt/zed/zed_node/odom", kOdometry}},
           "rt/zed/zed_node/depth/depth_registered",
           "rt/zed/zed_node/depth/camera_info"},
          {"orbbec",
           "orbbec",
           {{"rt/camera/color/camera_info", kInfo},
            {"rt/camera/color/image_raw", kImage},
            {"rt/camera/depth/image_raw", kImage},
            {"rt/camera/depth/camera_info", kInfo},
            {"rt/camera/ir/image_raw", kImage},
            {"rt/camera/ir/camera_info", kInfo}},
           "rt/camera/depth/image_raw",
           "rt/camera/depth/camera_info"},
          {"oak_d",
           "oak_d",
           {{"rt/oak/rgb/image_raw", kImage},
            {"rt/oak/rgb/camera_info", kInfo},
            {"rt/oak/stereo/image_raw", kImage},
            {"rt/oak/stereo/camera_info", kInfo}},
           "rt/oak/stereo/image_raw",
           "rt/oak/stereo/camera_info"},
          {"isaac_sim",
           "isaac_sim",
           {{"rt/rgb", kImage},
            {"rt/depth", kImage},
            {"rt/camera_info", kInfo},
            {"rt/semantic_segmentation", kImage},
            {"rt/odom", kOdometry}},
           "rt/depth",
           "rt/camera_info"}};
}

/// As if the driver were started in a namespace; `camera` stays below where the driver keeps it.
std::string in_namespace(const std::string& topic, const std::string& robot, bool replaces_first) {
  const std::string rest = topic.substr(3);
  return "rt/" + robot + "/" + (replaces_first ? rest.substr(rest.find('/') + 1) : rest);
}

std::string config_file(const std::string& name) {
  return std::string(POCD_SOURCE_DIR) + "/config/cameras/" + name + ".yaml";
}

InputConfig load(const std::string& name) {
  NodeFile file;
  load_config(file, {std::string(POCD_SOURCE_DIR) + "/config/torwic.yaml", config_file(name)});
  return file.node;
}

std::string robot_of(const InputConfig& input, const std::string& topic, InputStream stream) {
  for (const InputTopic& to : InputTopics(input).find(topic)) {
    if (to.stream == stream) return to.robot;
  }
  return "nobody";
}

TEST(SuggestInput, FindsTheDepthCameraOfEveryDriver) {
  for (const Camera& camera : cameras()) {
    const std::vector<RobotConfig> robots = suggest_robots(camera.topics);
    ASSERT_EQ(robots.size(), 1u) << camera.name;
    EXPECT_EQ(robots[0].depth_topic, camera.depth) << camera.name;
    EXPECT_EQ(robots[0].camera_info_topic, camera.info) << camera.name;
  }
  EXPECT_EQ(suggest_robots(cameras()[1].topics)[0].odometry_topic, "rt/zed/zed_node/odom");
  EXPECT_EQ(suggest_robots(cameras()[4].topics)[0].segmentation_topic, "rt/semantic_segmentation");
}

TEST(SuggestInput, TheYamlLoadsAndIsForTheSameTopics) {
  std::vector<TopicInfo> topics;
  for (const std::string robot : {"r1", "r2"}) {
    for (const std::string side : {"front", "back"}) {
      topics.push_back({"rt/" + robot + "/" + side + "/depth/image_raw", kImage});
      topics.push_back({"rt/" + robot + "/" + side + "/depth/camera_info", kInfo});
    }
    topics.push_back({"rt/" + robot + "/odom", kOdometry});
    topics.push_back({"rt/" + robot + "/tf", kTf});
    topics.push_back({"rt/" + robot + "/tf_static", kTf});
  }
  const std::vector<RobotConfig> robots = suggest_robots(topics);
  ASSERT_EQ(robots.size(), 4u);
  const std::string path = testing::TempDir() + "/pocd_suggestion.yaml";
  std::ofstream(path) << suggestion_yaml(robots);
  NodeFile file;
  load_config(file, {path});
  ASSERT_EQ(file.node.robots.size(), 4u);
  EXPECT_EQ(file.node.robots[0].name, "r1_back");
  EXPECT_EQ(file.node.robots[0].camera_info_topic, "rt/r1/back/depth/camera_info");
  EXPECT_EQ(file.node.robots[0].odometry_topic, "rt/r1/odom");
  EXPECT_EQ(file.node.robots[3].tf_static_topic, "rt/r2/tf_static");
  // Odometry feeds both cameras of its robot, and no other.
  EXPECT_EQ(InputTopics(file.node).find("rt/r1/odom").size(), 2u);
}

TEST(SuggestInput, TheTextListsImageTopicsAndWhatToWrite) {
  EXPECT_EQ(suggestion_text({}), "there is no topic at all");
  EXPECT_EQ(suggestion_text({{"rt/odom", kOdometry}, {"rt/depth", "foxglove.RawImage"}}),
            "there is no image topic; topics are: rt/odom (nav_msgs/msg/Odometry), rt/depth "
            "(foxglove.RawImage)");
  const std::string text = suggestion_text(cameras()[0].topics);
  EXPECT_NE(text.find("rt/camera/camera/infra1/image_rect_raw"), std::string::npos) << text;
  EXPECT_NE(
      text.find("--set 'node.topics.depth=rt/{robot}/camera/aligned_depth_to_color/image_raw' "
                "--set 'node.topics.camera_info="
                "rt/{robot}/camera/aligned_depth_to_color/camera_info'"),
      std::string::npos)
      << text;
}

/// The part of a suggestion that is to be pasted.
std::string options_in(const std::vector<TopicInfo>& topics) {
  const std::string text = suggestion_text(topics);
  const std::size_t at = text.find("; try ");
  return at == std::string::npos ? text : text.substr(at + 6);
}

std::vector<TopicInfo> robot_at(const std::string& place) {
  return {{place + "/depth/image_raw", kImage},
          {place + "/depth/camera_info", kInfo},
          {place + "/segmentation", kImage},
          {place + "/odom", kOdometry}};
}
std::vector<TopicInfo> both(std::vector<TopicInfo> one, const std::vector<TopicInfo>& other) {
  one.insert(one.end(), other.begin(), other.end());
  return one;
}

// What is pasted is enough: all streams of all robots.
TEST(SuggestInput, TheOptionsAreForAllStreamsAndRobots) {
  EXPECT_EQ(options_in(both(robot_at("rt/fleet/r1"), robot_at("rt/fleet/r2"))),
            "--set 'node.topics.depth=rt/fleet/{robot}/depth/image_raw' "
            "--set 'node.topics.camera_info=rt/fleet/{robot}/depth/camera_info' "
            "--set 'node.topics.segmentation=rt/fleet/{robot}/segmentation' "
            "--set 'node.topics.odometry=rt/fleet/{robot}/odom'");
  // Without a part that could be the robot, it is named.
  EXPECT_EQ(options_in(robot_at("rt")),
            "--robot robot --set 'node.topics.depth=rt/depth/image_raw' "
            "--set 'node.topics.camera_info=rt/depth/camera_info' "
            "--set 'node.topics.segmentation=rt/segmentation' "
            "--set 'node.topics.odometry=rt/odom'");
  // YAML would take text that begins with a brace for a group of keys.
  EXPECT_EQ(options_in({{"a/depth", kImage}}), "--set 'node.topics.depth=\"{robot}/depth\"'");
  // Robots whose names have no pattern in common.
  EXPECT_NE(options_in(both(robot_at("rt/r1"), {{"rt/cam/depth", kImage}, {"rt/cam/i", kInfo}}))
                .find("pocd_info --suggest FILE"),
            std::string::npos);
  // Depth can be a PNG on /compressed.
  EXPECT_EQ(options_in({{"rt/a/depth/image_raw/compressed", kCompressed}})
                .find("--set 'node.topics.depth=rt/{robot}/depth/image_raw/compressed'"),
            0u);
}

TEST(SuggestInput, WhatAStreamHasInsteadIsListedWithTheOption) {
  const std::vector<TopicInfo> topics{{"rt/a/depth/image_raw", kImage},
                                      {"rt/a/segmentation/compressed", kCompressed},
                                      {"rt/a/color/image_raw/compressed", kCompressed},
                                      {"rt/info", kInfo},
                                      {"rt/a/tf", kTf},
                                      {"rt/a/tf_static", kTf}};
  RobotConfig robot;
  robot.name = "a";
  InputConfig input;
  const auto instead = [&](InputStream stream) { return instead_of(stream, robot, input, topics); };
  EXPECT_EQ(instead(InputStream::kSegmentation),
            "there is rt/a/segmentation/compressed; try --set "
            "'node.topics.segmentation=rt/{robot}/segmentation/compressed'");
  EXPECT_EQ(instead(InputStream::kCameraInfo),
            "there is rt/info; try --robot a --set 'node.topics.camera_info=rt/info'");
  EXPECT_EQ(instead(InputStream::kOdometry),
            "there is rt/a/tf (tf2_msgs/msg/TFMessage), rt/a/tf_static (tf2_msgs/msg/TFMessage); "
            "try --set 'node.topics.tf=rt/{robot}/tf' --set "
            "'node.topics.tf_static=rt/{robot}/tf_static'");
  input.robots = {robot};
  EXPECT_EQ(instead(InputStream::kCameraInfo),
            "there is rt/info; try --set 'node.topics.camera_info=rt/info'");
  robot.name = "b";
  EXPECT_EQ(instead(InputStream::kSegmentation), "") << "that of a named robot is not another's";
  robot.name = "a";
  input.topics.camera_info = "rt/info";
  EXPECT_EQ(instead(InputStream::kCameraInfo), "") << "it is what is looked at";
}

TEST(SuggestInput, ReadsNamesOfTypesAsTheyAreOnTheBus) {
  EXPECT_EQ(ros_type_name("sensor_msgs/Image"), kImage);
  EXPECT_EQ(ros_type_name("sensor_msgs/msg/Image"), kImage);
  EXPECT_EQ(ros_type_name("sensor_msgs::msg::dds_::CompressedImage_"), kCompressed);
  EXPECT_EQ(ros_type_name("HelloWorld"), "HelloWorld");
}

// The files that are shipped for cameras, with the topics that the drivers announce.
TEST(CameraConfigs, NameTheDriversTopicsWithAndWithoutNamespace) {
  for (const Camera& camera : cameras()) {
    const InputConfig single = load(camera.file);
    EXPECT_EQ(robot_of(single, camera.depth, InputStream::kDepth), "robot1") << camera.name;
    EXPECT_EQ(robot_of(single, camera.info, InputStream::kCameraInfo), "robot1") << camera.name;
    const InputConfig fleet = load(std::string(camera.file) + "_namespaced");
    const bool replaces =
        std::string(camera.name) == "realsense" || std::string(camera.name) == "zed";
    for (const std::string robot : {"r1", "r2"}) {
      EXPECT_EQ(robot_of(fleet, in_namespace(camera.depth, robot, replaces), InputStream::kDepth),
                robot)
          << camera.name;
      EXPECT_EQ(
          robot_of(fleet, in_namespace(camera.info, robot, replaces), InputStream::kCameraInfo),
          robot)
          << camera.name;
    }
  }
  const InputConfig two = load("two_cameras");
  EXPECT_EQ(InputTopics(two).find("rt/robot1/odom").size(), 2u);
  EXPECT_EQ(InputTopics(two).find("rt/robot1/tf").size(), 2u);
  EXPECT_EQ(robot_of(two, "rt/robot1/back/aligned_depth_to_color/image_raw", InputStream::kDepth),
            "robot1_back");
}

TEST(InputTopics, NamesOfRosMeanTheSameAsNamesOnTheBus) {
  InputConfig input;
  input.topics.depth = "/{robot}/d";
  EXPECT_EQ(robot_of(input, "rt/a/d", InputStream::kDepth), "a");
  RobotConfig robot;
  robot.name = "b";
  robot.depth_topic = "/special";
  input.robots = {robot};
  EXPECT_EQ(robot_of(input, "rt/special", InputStream::kDepth), "b");
  EXPECT_EQ(robot_of(input, "rt/b/d", InputStream::kDepth), "nobody");
  EXPECT_TRUE(is_compressed_name("rt/a/depth/compressedDepth"));
  EXPECT_FALSE(is_compressed_name("rt/a/compressed_things"));
}

}  // namespace
}  // namespace pocd

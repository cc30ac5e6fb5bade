#include <gtest/gtest.h>

#include "image_helpers.hpp"
#include "scratch_folder.hpp"

namespace pocd {
namespace {

TEST(OpenDataset, UnknownFormatListsTheKnownOnes) {
  DatasetOptions options;
  options.format = "rosbag";
  options.inputs = {"somewhere"};
  const std::string error = open_error(options);
  for (const char* word : {"rosbag", "torwic", "rgbd", "pcd", "sim"}) {
    EXPECT_NE(error.find(word), std::string::npos) << error;
  }
}

TEST(OpenDataset, MissingFolderIsNamed) {
  for (const char* format : {"torwic", "rgbd", "pcd", "sim"}) {
    DatasetOptions options;
    options.format = format;
    options.inputs = {"/nowhere/at_all.yaml"};
    options.camera = CameraModel{4, 4, 1, 1, 1, 1};
    options.T_W_C = Pose::Identity();
    EXPECT_NE(open_error(options).find("/nowhere/at_all"), std::string::npos) << format;
    options.inputs.clear();
    EXPECT_NE(open_error(options), "") << format;
  }
}

TEST(OpenDataset, EmptyFolderIsNamed) {
  const ScratchFolder folder;
  folder.write("camera-intrinsics.txt", "1 0 1\n0 1 1\n0 0 1\n");
  folder.write("poses.txt", "");
  for (const char* format : {"torwic", "rgbd", "pcd"}) {
    DatasetOptions options;
    options.format = format;
    options.inputs = {folder.path()};
    options.camera = CameraModel{4, 4, 1, 1, 1, 1};
    options.T_W_C = Pose::Identity();
    EXPECT_NE(open_error(options).find(folder.path().string()), std::string::npos) << format;
  }
}

TEST(OpenDataset, SimulatorTakesScenariosInOrder) {
  const std::filesystem::path scenarios =
      std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/torwic";
  DatasetOptions options;
  options.format = "sim";
  options.inputs = {scenarios / "0.yaml"};
  const std::size_t one = open_dataset(options)->size();
  options.inputs.push_back(scenarios / "2-1.yaml");
  options.sensor = "perfect";
  const auto both = open_dataset(options);
  EXPECT_EQ(both->size(), 2 * one);
  EXPECT_EQ(both->extrinsics().camera_frame, "realsense_front_camera_color_optical_frame");
  ASSERT_TRUE(both->next().has_value());
  options.sensor = "lidar";
  EXPECT_NE(open_error(options).find("lidar"), std::string::npos);
}

}  // namespace
}  // namespace pocd

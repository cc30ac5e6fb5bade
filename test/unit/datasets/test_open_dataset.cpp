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
  for (const char* word : {"rosbag", "torwic", "rgbd", "pcd", "mcap"}) {
    EXPECT_NE(error.find(word), std::string::npos) << error;
  }
}

TEST(OpenDataset, MissingFolderIsNamed) {
  for (const char* format : {"torwic", "rgbd", "pcd"}) {
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

}  // namespace
}  // namespace pocd

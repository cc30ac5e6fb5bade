#include <gtest/gtest.h>

#include "image_helpers.hpp"
#include "scratch_folder.hpp"

namespace pocd {
namespace {

TEST(OpenDataset, UnknownFormatListsTheKnownOnes) {
  DatasetOptions options;
  options.format = static_cast<DatasetFormat>(77);
  options.inputs = {"somewhere"};
  const std::string error = open_error(options);
  for (const char* word : {"77", "torwic", "rgbd", "pcd", "sim"}) {
    EXPECT_NE(error.find(word), std::string::npos) << error;
  }
}

TEST(OpenDataset, MissingFolderIsNamed) {
  for (const auto format :
       {DatasetFormat::kTorwic, DatasetFormat::kRgbd, DatasetFormat::kPcd, DatasetFormat::kSim}) {
    DatasetOptions options;
    options.format = format;
    options.inputs = {"/nowhere/at_all.yaml"};
    options.camera = CameraModel{4, 4, 1, 1, 1, 1};
    options.T_W_C = Pose::Identity();
    EXPECT_NE(open_error(options).find("/nowhere/at_all"), std::string::npos) << word_of(format);
    options.inputs.clear();
    EXPECT_NE(open_error(options), "") << word_of(format);
  }
}

TEST(OpenDataset, EmptyFolderIsNamed) {
  const ScratchFolder folder;
  folder.write("camera-intrinsics.txt", "1 0 1\n0 1 1\n0 0 1\n");
  folder.write("poses.txt", "");
  for (const auto format : {DatasetFormat::kTorwic, DatasetFormat::kRgbd, DatasetFormat::kPcd}) {
    DatasetOptions options;
    options.format = format;
    options.inputs = {folder.path()};
    options.camera = CameraModel{4, 4, 1, 1, 1, 1};
    options.T_W_C = Pose::Identity();
    EXPECT_NE(open_error(options).find(folder.path().string()), std::string::npos)
        << word_of(format);
  }
}

TEST(OpenDataset, SimulatorTakesScenariosInOrder) {
  const std::filesystem::path scenarios =
      std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/torwic";
  DatasetOptions options;
  options.format = DatasetFormat::kSim;
  options.inputs = {scenarios / "0.yaml"};
  const std::size_t one = open_dataset(options)->size();
  options.inputs.push_back(scenarios / "2-1.yaml");
  options.sensor = SensorKind::kPerfect;
  const auto both = open_dataset(options);
  EXPECT_EQ(both->size(), 2 * one);
  EXPECT_EQ(both->extrinsics().camera_frame, "realsense_front_camera_color_optical_frame");
  ASSERT_TRUE(both->next().has_value());
}

}  // namespace
}  // namespace pocd

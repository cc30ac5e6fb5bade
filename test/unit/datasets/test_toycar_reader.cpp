#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <limits>

#include "image_helpers.hpp"
#include "scratch_folder.hpp"

namespace pocd {
namespace {

std::string numbered(const char* folder_and_stem, int number, const char* suffix) {
  char name[64];
  std::snprintf(name, sizeof name, "%s%04d%s", folder_and_stem, number, suffix);
  return name;
}

const char* kTrajectory =
    "1 0.5 -1 2 0 0 0 1\n2 0.6 -1 2 0 0 0 1\n3 0.7 -1 2 0 0 0.7071068 0.7071068\n";

/// Three frames as Co-Fusion's synthetic sequences have them.
void make_sequence(const ScratchFolder& folder, const char* depth = "depth_noise/Depth") {
  ::setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 0);  // writing asks for it before the reader does
  folder.write("calibration.txt", "30 31 15.5 11.5 32 24\n");
  folder.write("trajectories/gt-cam-0.txt", kTrajectory);
  for (int i = 1; i <= 3; ++i) {
    cv::Mat metres(24, 32, CV_32FC1, cv::Scalar(1.25));
    metres.at<float>(0, 0) = std::numeric_limits<float>::infinity();
    metres.at<float>(2, 3) = 0.75f + static_cast<float>(i);
    write_image(folder / numbered(depth, i, ".exr"), metres);
    cv::Mat ids(24, 32, CV_8UC1, cv::Scalar(0));
    ids.at<std::uint8_t>(5, 6) = 2;
    write_image(folder / numbered("mask_id/Mask", i, ".png"), ids);
    write_image(folder / numbered("colour/Color", i, ".png"),
                cv::Mat(24, 32, CV_8UC3, cv::Scalar(10, 20, 30)));
  }
}

DatasetOptions options_for(const ScratchFolder& folder) {
  return dataset_options(DatasetFormat::kToycar, folder.path(), 10.0);
}

TEST(ToycarReader, ReadsFrames) {
  const ScratchFolder folder;
  make_sequence(folder);
  const auto reader = open_dataset(options_for(folder));
  EXPECT_EQ(reader->size(), 3u);
  const std::vector<Frame> frames = read_all(*reader);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_TRUE(reader->problems().empty());
  EXPECT_EQ(frames[0].camera, (CameraModel{32, 24, 30, 31, 15.5, 11.5}));
  EXPECT_EQ(frames[2].stamp_ns, 200'000'000);
  EXPECT_EQ(frames[0].depth_m.at<float>(0, 0), 0.0f) << "infinite depth is no return";
  EXPECT_EQ(frames[1].depth_m.at<float>(2, 3), 2.75f);
  EXPECT_EQ(frames[1].labels.at<std::uint16_t>(5, 6), 2);
  EXPECT_EQ(frames[0].T_W_C.translation(), Eigen::Vector3d(0.5, -1, 2));
  EXPECT_NEAR((frames[2].T_W_C.linear().col(0) - Eigen::Vector3d::UnitY()).norm(), 0.0, 1e-6);
  EXPECT_EQ(frames[0].color.size(), cv::Size(32, 24));
}

TEST(ToycarReader, TakesTheNoisyDepthAndMillimetresToo) {
  const ScratchFolder folder;
  make_sequence(folder);
  for (int i = 1; i <= 3; ++i) {  // would be read if the noisy one were not preferred
    write_image(folder / numbered("depth_original/Depth", i, ".png"), ramp_depth());
  }
  EXPECT_EQ(open_dataset(options_for(folder))->next()->depth_m.at<float>(2, 3), 1.75f);
  std::filesystem::remove_all(folder / "depth_noise");
  EXPECT_NEAR(open_dataset(options_for(folder))->next()->depth_m.at<float>(2, 3), 1.032, 1e-6);
}

TEST(ToycarReader, LevelsTheWorldAndGoesOnToTheNextFolder) {
  const ScratchFolder folder;
  make_sequence(folder);
  DatasetOptions options = options_for(folder);
  options.gravity_W = Eigen::Vector3d::UnitY();
  options.inputs.push_back(folder.path());
  const std::vector<Frame> frames = read_all(*open_dataset(options));
  ASSERT_EQ(frames.size(), 6u);
  EXPECT_NEAR(frames[0].T_W_C.translation().z(), 1.0, 1e-9);
  EXPECT_EQ(frames[5].stamp_ns, 500'000'000);
}

TEST(ToycarReader, AFolderThatCannotBeReadIsRefusedByName) {
  struct Case {
    const char* file;
    const char* text;  // null: removed
    const char* expected;
  };
  for (const Case& c : {Case{"calibration.txt", nullptr, "calibration.txt"},
                        Case{"calibration.txt", "30 31 15.5 11.5 32\n", "calibration.txt"},
                        Case{"calibration.txt", "0 31 15.5 11.5 32 24\n", "calibration.txt"},
                        Case{"calibration.txt", "30 31 15.5 11.5 32.5 24\n", "whole numbers"},
                        Case{"calibration.txt", "30 31 15.5 11.5 1e300 24\n", "camera width"},
                        Case{"trajectories/gt-cam-0.txt", nullptr, "gt-cam-0.txt"},
                        Case{"depth_noise", nullptr, "has no folder depth_noise"},
                        Case{"gravity.txt", "0 9.81 0\n", "gravity.txt"}}) {
    const ScratchFolder folder;
    make_sequence(folder);
    if (c.text) {
      folder.write(c.file, c.text);
    } else {
      std::filesystem::remove_all(folder / c.file);
    }
    EXPECT_NE(open_error(options_for(folder)).find(c.expected), std::string::npos)
        << c.file << ": " << open_error(options_for(folder));
  }
}

TEST(ToycarReader, ABadFrameIsSkippedAndNamed) {
  struct Case {
    const char* name;
    std::function<void(const ScratchFolder&)> damage;
    const char* expected;
    std::size_t good;
  };
  const auto pose_line = [](const char* second) {
    return [=](const ScratchFolder& f) {
      f.write("trajectories/gt-cam-0.txt",
              "1 0.5 -1 2 0 0 0 1\n" + std::string(second) + "3 0.7 -1 2 0 0 0 1\n");
    };
  };
  const Case cases[] = {
      {"pose is missing", pose_line(""), "Depth0002.exr", 2},
      {"pose is short", pose_line("2 0.6 -1 2 0 0 0\n"), "gt-cam-0.txt:2", 2},
      {"pose is not finite", pose_line("2 nan -1 2 0 0 0 1\n"), "gt-cam-0.txt:2", 2},
      {"quaternion is zero", pose_line("2 0.6 -1 2 0 0 0 0\n"), "quaternion", 2},
      {"number with a fraction", pose_line("2 0.6 -1 2 0 0 0 1\n1.5 0.6 -1 2 0 0 0 1\n"),
       "gt-cam-0.txt:3: does not begin with an image number", 3},
      {"number beyond any", pose_line("2 0.6 -1 2 0 0 0 1\n4294967297 0.6 -1 2 0 0 0 1\n"),
       "gt-cam-0.txt:3: does not begin with an image number", 3},
      {"number twice", pose_line("2 0.6 -1 2 0 0 0 1\n2 9 9 9 0 0 0 1\n"),
       "gt-cam-0.txt:3: number 2 again", 3},
      {"line without number", pose_line("2 0.6 -1 2 0 0 0 1\nx\n"), "gt-cam-0.txt:3", 3},
      {"pose without image", pose_line("2 0.6 -1 2 0 0 0 1\n9 0.6 -1 2 0 0 0 1\n"),
       "no depth image 9", 3},
      {"depth is truncated",
       [](const ScratchFolder& f) { truncate(f / "depth_noise/Depth0002.exr"); }, "Depth0002.exr",
       2},
      {"depth is text",
       [](const ScratchFolder& f) { f.write("depth_noise/Depth0002.exr", "no image"); },
       "Depth0002.exr", 2},
      {"depth has another size",
       [](const ScratchFolder& f) {
         write_image(f / "depth_noise/Depth0002.exr", cv::Mat(12, 32, CV_32FC1, cv::Scalar(1)));
       },
       "Depth0002.exr", 2},
      {"mask is missing",
       [](const ScratchFolder& f) { std::filesystem::remove(f / "mask_id/Mask0002.png"); },
       "mask_id", 2},
      {"mask is coloured",
       [](const ScratchFolder& f) {
         write_image(f / "mask_id/Mask0002.png", cv::Mat(24, 32, CV_8UC3, cv::Scalar(1, 2, 3)));
       },
       "Mask0002.png", 2},
      {"colour is truncated", [](const ScratchFolder& f) { truncate(f / "colour/Color0002.png"); },
       "Color0002.png", 2},
  };
  for (const Case& c : cases) {
    const ScratchFolder folder;
    make_sequence(folder);
    c.damage(folder);
    const auto reader = open_dataset(options_for(folder));
    EXPECT_EQ(read_all(*reader).size(), c.good) << c.name;
    ASSERT_EQ(reader->problems().size(), 1u) << c.name;
    EXPECT_NE(reader->problems()[0].find(c.expected), std::string::npos)
        << c.name << ": " << reader->problems()[0];
  }
}

}  // namespace
}  // namespace pocd

#include <gtest/gtest.h>

#include "image_helpers.hpp"
#include "scratch_folder.hpp"

namespace pocd {
namespace {

const char* kPose = "1 0 0 0.5\n0 1 0 -1\n0 0 1 2\n0 0 0 1\n";

std::string stem(int number) {
  char name[32];
  std::snprintf(name, sizeof name, "frame-%06d", number);
  return name;
}

/// `count` good frames and intrinsics.
void make_sequence(const ScratchFolder& folder, int count) {
  folder.write("camera-intrinsics.txt", "30 0 15.5\n0 31 11.5\n0 0 1\n");
  for (int i = 0; i < count; ++i) {
    write_image(folder / (stem(i) + ".depth.png"), ramp_depth());
    write_image(folder / (stem(i) + ".color.jpg"),
                cv::Mat(24, 32, CV_8UC3, cv::Scalar(10, 20, 30)));
    folder.write(stem(i) + ".pose.txt", kPose);
  }
}

DatasetOptions options_for(const ScratchFolder& folder) {
  return dataset_options(DatasetFormat::kRgbd, folder.path(), 10.0);
}

TEST(RgbdReader, ReadsFrames) {
  const ScratchFolder folder;
  make_sequence(folder, 3);
  const auto reader = open_dataset(options_for(folder));
  EXPECT_EQ(reader->size(), 3u);
  const std::vector<Frame> frames = read_all(*reader);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[2].stamp_ns, 200'000'000);
  EXPECT_EQ(frames[2].sequence, 2u);
  EXPECT_EQ(frames[0].camera, (CameraModel{32, 24, 30, 31, 15.5, 11.5}));
  EXPECT_NEAR(frames[0].depth_m.at<float>(2, 3), 1.032, 1e-6);  // rounding of a float
  EXPECT_EQ(frames[0].T_W_C.translation(), Eigen::Vector3d(0.5, -1, 2));
  EXPECT_TRUE(frames[0].labels.empty());
  EXPECT_EQ(frames[0].color.size(), cv::Size(32, 24));
  EXPECT_TRUE(reader->problems().empty());
}

TEST(RgbdReader, SeveralFoldersGoOn) {
  const ScratchFolder folder;
  make_sequence(folder, 2);
  DatasetOptions options = options_for(folder);
  options.inputs.push_back(folder.path());
  const std::vector<Frame> frames = read_all(*open_dataset(options));
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(frames[3].stamp_ns, 300'000'000);
}

TEST(RgbdReader, LevelsTheWorld) {
  const ScratchFolder folder;
  make_sequence(folder, 1);
  // Gravity along +y: the world's y axis must become -z.
  DatasetOptions options = options_for(folder);
  options.gravity_W = Eigen::Vector3d::UnitY();
  const Frame by_option = *open_dataset(options)->next();
  // The camera is not turned against the world, so its y axis is the world's.
  EXPECT_NEAR((by_option.T_W_C.linear().col(1) + Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-9);
  EXPECT_NEAR(by_option.T_W_C.translation().z(), 1.0, 1e-9);
  folder.write("gravity.txt", "0 1 0\n");
  const Frame by_file = *open_dataset(options_for(folder))->next();
  EXPECT_TRUE(by_file.T_W_C.isApprox(by_option.T_W_C, 1e-12));
  options.gravity_W = -Eigen::Vector3d::UnitZ();  // the option wins
  EXPECT_NEAR(open_dataset(options)->next()->T_W_C.translation().z(), 2.0, 1e-9);
  folder.write("gravity.txt", "0 9.81 0\n");
  EXPECT_NE(open_error(options_for(folder)).find("gravity.txt"), std::string::npos);
}

TEST(RgbdReader, BadIntrinsicsAreNamed) {
  for (const char* text :
       {"0 0 15.5\n0 31 11.5\n0 0 1\n", "30 0 15.5\n0 nan 11.5\n0 0 1\n", "30 0 15.5\n0 31 11.5\n",
        "30 15.5\n31 11.5\n0 1\n", "a b c\nd e f\n0 0 1\n", "30 0 15.5\n0 31 11.5\n0 0 2\n"}) {
    const ScratchFolder folder;
    make_sequence(folder, 1);
    folder.write("camera-intrinsics.txt", text);
    EXPECT_NE(open_error(options_for(folder)).find("camera-intrinsics.txt"), std::string::npos)
        << text;
  }
}

struct Defect {
  const char* name;
  void (*make)(const ScratchFolder& folder);  // spoils frame 1
  const char* problem;                        // part of the one line reported
};

class RgbdDefect : public testing::TestWithParam<Defect> {};

TEST_P(RgbdDefect, SkipsTheFrameAndSaysWhy) {
  const ScratchFolder folder;
  make_sequence(folder, 3);
  GetParam().make(folder);
  const auto reader = open_dataset(options_for(folder));
  const std::vector<Frame> frames = read_all(*reader);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[1].sequence, 2u);
  EXPECT_EQ(reader->skipped(), 1u);
  ASSERT_EQ(reader->problems().size(), 1u);
  const std::string& problem = reader->problems()[0];
  EXPECT_NE(problem.find(GetParam().problem), std::string::npos) << problem;
  EXPECT_NE(problem.find("frame-000001"), std::string::npos) << problem;
  EXPECT_EQ(problem.find('\n'), std::string::npos);
}

const Defect kDefects[] = {
    {"truncated_depth", [](const ScratchFolder& f) { truncate(f / (stem(1) + ".depth.png")); },
     "truncated"},
    {"truncated_color", [](const ScratchFolder& f) { truncate(f / (stem(1) + ".color.jpg")); },
     "truncated"},
    {"empty_depth", [](const ScratchFolder& f) { f.write(stem(1) + ".depth.png", ""); }, "empty"},
    {"depth_is_text", [](const ScratchFolder& f) { f.write(stem(1) + ".depth.png", "hello"); },
     "no PNG, JPEG or OpenEXR image"},
    {"damaged_depth",
     [](const ScratchFolder& f) {
       std::fstream file(f / (stem(1) + ".depth.png"),
                         std::ios::in | std::ios::out | std::ios::binary);
       file.seekp(60);
       file << "damage damage damage";
     },
     ""},
    {"depth_is_rgb",
     [](const ScratchFolder& f) {
       write_image(f / (stem(1) + ".depth.png"), cv::Mat(24, 32, CV_8UC3, cv::Scalar(1, 2, 3)));
     },
     "3 channel(s) of 8 bits"},
    {"depth_of_other_size",
     [](const ScratchFolder& f) { write_image(f / (stem(1) + ".depth.png"), ramp_depth(16, 24)); },
     "16x24"},
    {"missing_depth",
     [](const ScratchFolder& f) { std::filesystem::remove(f / (stem(1) + ".depth.png")); },
     "no depth"},
    {"missing_pose",
     [](const ScratchFolder& f) { std::filesystem::remove(f / (stem(1) + ".pose.txt")); },
     "no pose"},
    {"pose_nan",
     [](const ScratchFolder& f) {
       f.write(stem(1) + ".pose.txt", "1 0 0 0\n0 1 0 nan\n0 0 1 0\n0 0 0 1\n");
     },
     ".pose.txt:2: 'nan'"},
    {"pose_short_line",
     [](const ScratchFolder& f) {
       f.write(stem(1) + ".pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1\n0 0 0 1\n");
     },
     ".pose.txt:3: has 3"},
    {"pose_no_number",
     [](const ScratchFolder& f) {
       f.write(stem(1) + ".pose.txt", "one 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
     },
     ".pose.txt:1: 'one'"},
    {"pose_not_rigid",
     [](const ScratchFolder& f) {
       f.write(stem(1) + ".pose.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
     },
     "orthonormal"},
    {"pose_of_projection",
     [](const ScratchFolder& f) {
       f.write(stem(1) + ".pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 0\n");
     },
     "last row"},
};
INSTANTIATE_TEST_SUITE_P(Each, RgbdDefect, testing::ValuesIn(kDefects),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(RgbdReader, ReadsTheKitchen) {
  const std::filesystem::path kitchen = std::filesystem::path(POCD_TEST_DATA) / "redkitchen";
  if (!std::filesystem::exists(kitchen)) GTEST_SKIP() << kitchen << " is not there";
  DatasetOptions options;
  options.format = DatasetFormat::kRgbd;
  options.inputs = {kitchen};
  const auto reader = open_dataset(options);
  EXPECT_EQ(reader->size(), 300u);
  EXPECT_EQ(read_all(*reader).size(), 300u);
  EXPECT_TRUE(reader->problems().empty());
}

}  // namespace
}  // namespace pocd

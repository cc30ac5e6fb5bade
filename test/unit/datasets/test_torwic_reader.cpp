#include <gtest/gtest.h>

#include "image_helpers.hpp"
#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"
#include "pocd/datasets/torwic_writer.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"
#include "scratch_folder.hpp"

namespace pocd {
namespace {

const CameraModel kSmall{32, 24, 30, 31, 15.5, 11.5};

std::string pose_line(int index) {
  return std::to_string(index) + " 100 " + std::to_string(index * 66'000'000) +
         " 1 2 0.1 0 0 0 1\n";
}

/// Three good frames with images 0.png, 1.png, 2.png.
void make_sequence(const ScratchFolder& folder) {
  std::string poses;
  for (int i = 0; i < 3; ++i) {
    const std::string name = std::to_string(i) + ".png";
    write_image(folder.path() / "Depth" / name, ramp_depth());
    write_image(folder.path() / "Segmentation" / name, cv::Mat(24, 32, CV_8UC1, cv::Scalar(7)));
    write_image(folder.path() / "RGB" / name, cv::Mat(24, 32, CV_8UC3, cv::Scalar(1, 2, 3)));
    poses += pose_line(i);
  }
  folder.write("poses.txt", poses);
}

DatasetOptions options_for(const ScratchFolder& folder) {
  DatasetOptions options = dataset_options(DatasetFormat::kTorwic, folder.path(), 15.0);
  options.camera = kSmall;
  return options;
}

TEST(TorwicReader, ReadsFramesInNumericOrder) {
  const ScratchFolder folder;
  std::string poses;
  for (const int i : {2, 10, 9, 0}) {  // lexical order would put 10 before 2
    char name[32];
    std::snprintf(name, sizeof name, i < 5 ? "%04d.png" : "%d.png", i);
    write_image(folder.path() / "Depth" / name, ramp_depth());
    poses += pose_line(i);
  }
  folder.write("poses.txt", poses);
  const auto reader = open_dataset(options_for(folder));
  const std::vector<Frame> frames = read_all(*reader);
  ASSERT_EQ(frames.size(), 4u) << (reader->problems().empty() ? "" : reader->problems()[0]);
  EXPECT_EQ(frames[1].stamp_ns, 100'132'000'000);
  EXPECT_EQ(frames[3].stamp_ns, 100'660'000'000);
  EXPECT_TRUE(frames[0].labels.empty());  // no Segmentation and no RGB folder
  EXPECT_TRUE(frames[0].color.empty());
  // Poses are of base_link; the camera sits 0.52 m ahead of it and 0.011 m above (method.md).
  EXPECT_NEAR((frames[0].T_W_C.translation() - Eigen::Vector3d(1.520, 2.032, 0.111)).norm(), 0.0,
              1e-12);
  EXPECT_EQ(reader->extrinsics().camera_frame, "realsense_front_camera_color_optical_frame");
  // It looks forward and 15 degrees up.
  EXPECT_NEAR(frames[0].T_W_C.linear()(0, 2), 0.966, 1e-3);
  EXPECT_NEAR(frames[0].T_W_C.linear()(2, 2), 0.260, 1e-3);
}

// A second folder goes on at once; when it begins elsewhere, the camera had time to come there.
TEST(TorwicReader, AFolderThatBeginsElsewhereLeavesTimeForTheWay) {
  const ScratchFolder here, near, far, turned;
  for (const ScratchFolder* folder : {&here, &near, &far, &turned}) make_sequence(*folder);
  const auto elsewhere = [](const std::string& pose) {
    return "0 100 0 " + pose + "\n1 100 66000000 " + pose + "\n2 100 132000000 " + pose + "\n";
  };
  far.write("poses.txt", elsewhere("1 4 0.1 0 0 0 1"));
  turned.write("poses.txt", elsewhere("1 2 0.1 0 0 1 0"));
  const auto gap_s = [&](const ScratchFolder& second) {
    DatasetOptions options = options_for(here);
    options.inputs.push_back(second.path());
    const auto reader = open_dataset(options);
    const std::vector<Frame> frames = read_all(*reader);
    EXPECT_EQ(frames.size(), 6u);
    return static_cast<double>(frames[3].stamp_ns - frames[2].stamp_ns) * 1e-9;
  };
  EXPECT_NEAR(gap_s(near), 1.0 / 15.0, 1e-6);
  EXPECT_NEAR(gap_s(far), 2.0, 1e-6);     // 2 m at 1 m/s
  EXPECT_NEAR(gap_s(turned), 2.0, 1e-6);  // half a turn at 90 degrees a second
}

// SLAM begins at the origin, and converted sets at stamp 0.
TEST(TorwicReader, PoseOfIdentityAtStampZeroIsAPose) {
  const ScratchFolder folder;
  make_sequence(folder);
  folder.write("poses.txt", "0 0 0 0 0 0 0 0 0 1\n" + pose_line(1) + pose_line(2));
  const auto reader = open_dataset(options_for(folder));
  EXPECT_EQ(read_all(*reader).size(), 3u);
  EXPECT_TRUE(reader->problems().empty()) << reader->problems()[0];
}

TEST(TorwicReader, FoldersThatCannotBeReadAreNamed) {
  const ScratchFolder folder;
  make_sequence(folder);
  std::filesystem::remove_all(folder / "Segmentation");
  std::filesystem::create_symlink("Segmentation", folder / "Segmentation");  // leads to itself
  EXPECT_NE(open_error(options_for(folder)).find("Segmentation: cannot be read: "),
            std::string::npos)
      << open_error(options_for(folder));
  DatasetOptions options = options_for(folder);
  options.inputs = {folder / "Segmentation"};
  EXPECT_NE(open_error(options).find("Segmentation: cannot be read: "), std::string::npos)
      << open_error(options);
  options.format = DatasetFormat::kMcap;
  EXPECT_NE(open_error(options).find("Segmentation: cannot be read: "), std::string::npos)
      << open_error(options);
}

TEST(TorwicReader, StitchedInputsGoOn) {
  const ScratchFolder folder;
  make_sequence(folder);
  DatasetOptions options = options_for(folder);
  options.inputs.push_back(folder.path());
  const std::vector<Frame> frames = read_all(*open_dataset(options));
  ASSERT_EQ(frames.size(), 6u);
  EXPECT_EQ(frames[3].stamp_ns, frames[2].stamp_ns + 66'666'667);
  EXPECT_EQ(frames[5].stamp_ns - frames[3].stamp_ns, frames[2].stamp_ns - frames[0].stamp_ns);
  EXPECT_EQ(frames[5].sequence, 5u);
}

TEST(TorwicReader, ReadsWhatTheWriterWrote) {
  const ScratchFolder folder;
  Scenario scenario =
      load_scenario(std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/torwic/0.yaml");
  const SimReader simulated(scenario, {});
  {
    TorwicWriter writer(folder.path(), simulated.extrinsics().T_B_C);
    for (std::size_t i = 0; i < 3; ++i) writer.write(simulated.frame(i));
  }
  DatasetOptions options;
  options.format = DatasetFormat::kTorwic;
  options.inputs = {folder.path()};
  const auto reader = open_dataset(options);
  const std::vector<Frame> frames = read_all(*reader);
  ASSERT_EQ(frames.size(), 3u) << (reader->problems().empty() ? "" : reader->problems()[0]);
  for (std::size_t i = 0; i < 3; ++i) {
    const Frame expected = simulated.frame(i);
    EXPECT_EQ(frames[i].stamp_ns, expected.stamp_ns);
    EXPECT_EQ(frames[i].camera, expected.camera);
    // Rotation goes through a quaternion: rounding of a few operations.
    EXPECT_TRUE(frames[i].T_W_C.isApprox(expected.T_W_C, 1e-12));
    // The simulator's depth is in whole millimetres already: only float rounding is left.
    EXPECT_LT(cv::norm(frames[i].depth_m, expected.depth_m, cv::NORM_INF), 1e-5);
    EXPECT_EQ(cv::norm(frames[i].labels, expected.labels, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(frames[i].color, expected.color, cv::NORM_INF), 0.0);
  }
}

TEST(TorwicWriter, SaysWhereItCannotWrite) {
  const ScratchFolder folder;
  folder.write("file", "not a folder");
  EXPECT_THROW(TorwicWriter(folder / "file", Pose::Identity()), InputError);
}

struct Defect {
  const char* name;
  void (*make)(const ScratchFolder& folder);  // spoils frame 1
  const char* problem;
};

class TorwicDefect : public testing::TestWithParam<Defect> {};

TEST_P(TorwicDefect, SkipsTheFrameAndSaysWhy) {
  const ScratchFolder folder;
  make_sequence(folder);
  GetParam().make(folder);
  const auto reader = open_dataset(options_for(folder));
  const std::vector<Frame> frames = read_all(*reader);
  EXPECT_EQ(frames.size(), 2u);
  EXPECT_EQ(reader->skipped(), 1u);
  ASSERT_EQ(reader->problems().size(), 1u);
  const std::string& problem = reader->problems()[0];
  EXPECT_NE(problem.find(GetParam().problem), std::string::npos) << problem;
  EXPECT_NE(problem.find(folder.path().string()), std::string::npos) << problem;
  EXPECT_EQ(reader->size(), 3u);
}

void second_pose(const ScratchFolder& folder, const std::string& line) {
  folder.write("poses.txt", pose_line(0) + line + "\n" + pose_line(2));
}

const Defect kDefects[] = {
    {"pose_nan", [](const ScratchFolder& f) { second_pose(f, "1 100 66000000 nan 2 0 0 0 0 1"); },
     "poses.txt:2: 'nan'"},
    {"pose_short", [](const ScratchFolder& f) { second_pose(f, "1 100 66000000 1 2 0 0 0 0"); },
     "poses.txt:2: has 9"},
    {"pose_no_number",
     [](const ScratchFolder& f) { second_pose(f, "1 100 66000000 1 2 zero 0 0 0 1"); },
     "poses.txt:2: 'zero'"},
    {"pose_quaternion",
     [](const ScratchFolder& f) { second_pose(f, "1 100 66000000 1 2 0 0 0 0 0.5"); },
     "poses.txt:2: quaternion"},
    {"pose_stamp", [](const ScratchFolder& f) { second_pose(f, "1 100 -5 1 2 0 0 0 0 1"); },
     "poses.txt:2: stamp"},
    {"pose_stamp_goes_back", [](const ScratchFolder& f) { second_pose(f, "1 99 0 1 2 0 0 0 0 1"); },
     "not after"},
    {"pose_missing",
     [](const ScratchFolder& f) { f.write("poses.txt", pose_line(0) + pose_line(2)); },
     "no line with this index"},
    {"depth_missing",
     [](const ScratchFolder& f) { std::filesystem::remove(f.path() / "Depth/1.png"); },
     "Depth: no image 1"},
    {"labels_missing",
     [](const ScratchFolder& f) { std::filesystem::remove(f.path() / "Segmentation/1.png"); },
     "Segmentation: no image 1"},
    {"depth_truncated", [](const ScratchFolder& f) { truncate(f.path() / "Depth/1.png"); },
     "truncated"},
    {"depth_is_rgb",
     [](const ScratchFolder& f) {
       write_image(f.path() / "Depth/1.png", cv::Mat(24, 32, CV_8UC3, cv::Scalar(1, 2, 3)));
     },
     "3 channel(s) of 8 bits"},
    {"labels_are_rgb",
     [](const ScratchFolder& f) {
       write_image(f.path() / "Segmentation/1.png", cv::Mat(24, 32, CV_8UC3, cv::Scalar(1, 2, 3)));
     },
     "segmentation image has 1 channel"},
    {"labels_of_other_size",
     [](const ScratchFolder& f) {
       write_image(f.path() / "Segmentation/1.png", cv::Mat(24, 16, CV_8UC1, cv::Scalar(1)));
     },
     "16x24"},
    {"depth_of_other_size",
     [](const ScratchFolder& f) { write_image(f.path() / "Depth/1.png", ramp_depth(64, 48)); },
     "Depth/1.png: image is 64x48, camera is 32x24"},
    {"depth_announces_gigabytes",
     [](const ScratchFolder& f) {
       std::fstream file(f.path() / "Depth/1.png", std::ios::in | std::ios::out);
       file.seekp(16);
       file.write("\0\0\x4e\x20\0\0\x4e\x20", 8);  // 20000 x 20000
     },
     "image is 20000x20000, more than 16384 a side"},
    {"depth_is_a_folder",
     [](const ScratchFolder& f) {
       std::filesystem::remove(f.path() / "Depth/1.png");
       std::filesystem::create_directory(f.path() / "Depth/1.png");
     },
     "Depth: no image 1"},
};
INSTANTIATE_TEST_SUITE_P(Each, TorwicDefect, testing::ValuesIn(kDefects),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(TorwicReader, LinesThatBelongToNoFrameAreCounted) {
  const ScratchFolder folder;
  make_sequence(folder);
  folder.write("poses.txt", "# id sec nsec ...\n" + pose_line(0) + "x 1\n" + pose_line(1) +
                                pose_line(1) + pose_line(2));
  const auto reader = open_dataset(options_for(folder));
  EXPECT_EQ(read_all(*reader).size(), 3u);
  ASSERT_EQ(reader->problems().size(), 2u);
  EXPECT_NE(reader->problems()[0].find("poses.txt:3"), std::string::npos);
  EXPECT_NE(reader->problems()[1].find("poses.txt:5"), std::string::npos);
  EXPECT_EQ(reader->skipped(), 2u);
}

TEST(TorwicReader, BadCameraIsRefused) {
  const ScratchFolder folder;
  make_sequence(folder);
  DatasetOptions options = options_for(folder);
  options.camera->fy = -1;
  EXPECT_NE(open_error(options).find("fy"), std::string::npos);
  options = options_for(folder);
  std::filesystem::remove(folder / "poses.txt");
  EXPECT_NE(open_error(options).find("poses.txt"), std::string::npos);
}

}  // namespace
}  // namespace pocd

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <sstream>

#include "image_helpers.hpp"
#include "pocd/datasets/readers.hpp"
#include "scratch_folder.hpp"

namespace pocd {
namespace {

constexpr int kWidth = 8, kHeight = 6;

/// ASCII PCD: depth 1 + v / 10, label of column u as given by `labels`; the first pixel is NaN.
std::string ascii_pcd(const std::vector<int>& labels, bool organised = true) {
  std::ostringstream out;
  const int points = kWidth * kHeight;
  out << "# .PCD v0.7\nVERSION 0.7\nFIELDS label x y z rgba\nSIZE 4 4 4 4 4\nTYPE U F F F U\n"
      << "COUNT 1 1 1 1 1\nWIDTH " << (organised ? kWidth : points) << "\nHEIGHT "
      << (organised ? kHeight : 1) << "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << points
      << "\nDATA ascii\n";
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const std::string z = u == 0 && v == 0 ? "nan" : std::to_string(1.0 + 0.1 * v);
      out << labels[u] << " 0 0 " << z << " " << (0xFF000000u | (10u << 16) | (20u << 8) | 30u)
          << "\n";
    }
  }
  return out.str();
}

const std::vector<int> kLabels = {1, 0, 9, 10, 21, 35, 1, 1};

DatasetOptions options_for(const ScratchFolder& folder) {
  DatasetOptions options;
  options.format = DatasetFormat::kPcd;
  options.inputs = {folder.path()};
  options.camera = CameraModel{kWidth, kHeight, 10, 10, 3.5, 2.5};
  options.T_W_C = Pose::Identity();
  options.repeat = 2;
  options.frame_rate_hz = 10;
  return options;
}

TEST(PcdReader, MapsLabelsAndRepeats) {
  const ScratchFolder folder;
  folder.write("b.pcd", ascii_pcd(kLabels));
  folder.write("a.pcd", ascii_pcd(std::vector<int>(kWidth, 20)));
  const auto reader = open_dataset(options_for(folder));
  EXPECT_EQ(reader->size(), 4u);
  const std::vector<Frame> frames = read_all(*reader);
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(frames[3].stamp_ns, 300'000'000);
  EXPECT_EQ(frames[1].labels.at<std::uint16_t>(1, 0), 2);  // a.pcd comes first
  const int expected[kWidth] = {1, 0, 1, 2, 2, 2, 1, 1};
  for (int u = 0; u < kWidth; ++u) {
    EXPECT_EQ(frames[2].labels.at<std::uint16_t>(3, u), expected[u]) << u;
    const float depth = expected[u] == 0 ? 0.0f : 1.3f;
    EXPECT_NEAR(frames[2].depth_m.at<float>(3, u), depth, 1e-6);  // rounding of a float
  }
  EXPECT_EQ(frames[2].depth_m.at<float>(0, 0), 0.0f);  // was NaN
  EXPECT_EQ(frames[2].color.at<cv::Vec3b>(2, 2), cv::Vec3b(30, 20, 10));
}

std::string with_field(const std::string& name, const std::string& size, const std::string& type) {
  std::string text = ascii_pcd(kLabels);
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("FIELDS label", "FIELDS " + name);
  replace("SIZE 4", "SIZE " + size);
  replace("TYPE U", "TYPE " + type);
  return text;
}

// Eight bytes, too, and in capitals; what is called otherwise is not dropped without a word.
TEST(PcdReader, LabelsOfEveryTypeAreReadAndOthersAreNamed) {
  const std::pair<const char*, const char*> types[] = {{"1", "U"}, {"2", "I"}, {"4", "F"},
                                                       {"8", "I"}, {"8", "U"}, {"8", "F"}};
  for (const auto& [size, type] : types) {
    for (const char* name : {"label", "Labels"}) {
      const ScratchFolder folder;
      folder.write("a.pcd", with_field(name, size, type));
      const auto reader = open_dataset(options_for(folder));
      const std::vector<Frame> frames = read_all(*reader);
      ASSERT_EQ(frames.size(), 2u) << name << size << type;
      EXPECT_EQ(frames[0].labels.at<std::uint16_t>(3, 4), 2) << name << size << type;
      EXPECT_TRUE(reader->problems().empty());
    }
  }
  const ScratchFolder folder;
  folder.write("a.pcd", with_field("classification", "4", "U"));
  const auto reader = open_dataset(options_for(folder));
  const std::vector<Frame> frames = read_all(*reader);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(frames[0].labels.empty());
  ASSERT_EQ(reader->problems().size(), 1u);
  EXPECT_NE(reader->problems()[0].find(
                "a.pcd: has no field label; classification is not read: call it label"),
            std::string::npos);
}

TEST(PcdReader, KeepsInstances) {
  const ScratchFolder folder;
  folder.write("a.pcd", ascii_pcd(kLabels));
  DatasetOptions options = options_for(folder);
  options.label_divisor = 100;
  const Frame frame = *open_dataset(options)->next();
  const int expected[kWidth] = {100, 0, 100, 201, 202, 203, 100, 100};
  for (int u = 0; u < kWidth; ++u)
    EXPECT_EQ(frame.labels.at<std::uint16_t>(3, u), expected[u]) << u;
}

TEST(PcdReader, CameraFileBesideTheFiles) {
  const ScratchFolder folder;
  folder.write("a.pcd", ascii_pcd(kLabels));
  folder.write("camera.yaml",
               "camera: {width: 8, height: 6, fx: 12, fy: 13, cx: 3, cy: 2}\n"
               "T_W_C: {translation: [1, 2, 3], quaternion_xyzw: [1, 0, 0, 0]}\n");
  DatasetOptions options = options_for(folder);
  options.camera.reset();
  options.T_W_C.reset();
  const Frame frame = *open_dataset(options)->next();
  EXPECT_EQ(frame.camera, (CameraModel{8, 6, 12, 13, 3, 2}));
  EXPECT_EQ(frame.T_W_C.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(frame.T_W_C.linear()(2, 2), -1.0, 1e-12);
  for (const char* text :
       {"camara: {}\n", "camera: {width: 8}\n", "T_W_C: {translation: [1, 2, 3]}\n",
        "camera: {width: 8, height: 6, fx: 0, fy: 13, cx: 3, cy: 2}\n", "[\n"}) {
    folder.write("camera.yaml", text);
    EXPECT_NE(open_error(options).find("camera.yaml"), std::string::npos) << text;
  }
  std::filesystem::remove(folder / "camera.yaml");
  EXPECT_NE(open_error(options).find("no camera given"), std::string::npos);
}

TEST(PcdReader, BadFilesAreSkippedWithAllTheirRepeats) {
  const std::string good = ascii_pcd(kLabels);
  std::string other_size = good;
  other_size.replace(other_size.find("WIDTH 8"), 7, "WIDTH 6")
      .replace(other_size.find("HEIGHT 6"), 8, "HEIGHT 8");
  std::string no_z = good;
  no_z.replace(no_z.find("x y z"), 5, "x y k");
  // A compressed file that ends before the size in its header.
  std::string cut = good.substr(0, good.find("DATA"));
  const std::uint32_t sizes[2] = {100000, 960};
  cut += "DATA binary_compressed\n" + std::string(reinterpret_cast<const char*>(sizes), 8) + "abc";
  std::string garbage = good.substr(0, good.find("DATA"));
  const std::uint32_t few[2] = {12, 960};
  garbage += "DATA binary_compressed\n" + std::string(reinterpret_cast<const char*>(few), 8) +
             "garbage data";
  std::string binary = good.substr(0, good.find("DATA")) + "DATA binary\nshort";
  // 40 GB by the header of a small file, which would be made room for before the file is read.
  const auto announcing = [&](const std::string& data) {
    std::string text = good.substr(0, good.find("DATA"));
    text.replace(text.find("WIDTH 8"), 7, "WIDTH 16000");
    text.replace(text.find("HEIGHT 6"), 8, "HEIGHT 16000");
    return text.replace(text.find("POINTS 48"), 9, "POINTS 256000000") + data;
  };
  const std::string compressed(reinterpret_cast<const char*>(few), 8);
  std::string wide = good;
  wide.replace(wide.find("WIDTH 8"), 7, "WIDTH 48").replace(wide.find("HEIGHT 6"), 8, "HEIGHT 0");
  // The same with tabs and indented, as PCL reads it, too.
  std::string tabs = announcing("DATA\tbinary\n");
  for (std::size_t at = 0; (at = tabs.find("WIDTH ", at)) != std::string::npos;)
    tabs.replace(at, 6, " WIDTH\t");
  std::string no_number = good, no_width = good, ends = good.substr(0, good.find("DATA"));
  no_number.replace(no_number.find("WIDTH 8"), 7, "WIDTH 8x");
  no_width.replace(no_width.find("WIDTH 8"), 7, "BREADTH 8");
  const std::string cases[] = {tabs,
                               no_number,
                               no_width,
                               ends + "DATA binary",
                               "hello",
                               "",
                               ascii_pcd(kLabels, false),
                               other_size,
                               no_z,
                               cut,
                               garbage,
                               binary,
                               announcing("DATA ascii\n"),
                               announcing("DATA binary\n"),
                               announcing("DATA binary_compressed\n" + compressed + "garbage data"),
                               wide};
  for (std::size_t i = 0; i < std::size(cases); ++i) {
    const ScratchFolder folder;
    folder.write("a.pcd", good);
    folder.write("b.pcd", cases[i]);
    folder.write("c.pcd", good);
    const auto reader = open_dataset(options_for(folder));
    const std::vector<Frame> frames = read_all(*reader);
    EXPECT_EQ(frames.size(), 4u) << i;
    EXPECT_EQ(reader->skipped(), 2u) << i;
    ASSERT_EQ(reader->problems().size(), 1u) << i;
    EXPECT_NE(reader->problems()[0].find("b.pcd"), std::string::npos) << reader->problems()[0];
  }
}

// Four bytes are read of a colour: a field of one would give its neighbours, and bytes beyond the
// last point.
TEST(PcdReader, ANarrowColourFieldIsNone) {
  std::string text = ascii_pcd(kLabels);
  text.replace(text.find("SIZE 4 4 4 4 4"), 14, "SIZE 4 4 4 4 1");
  for (std::size_t at = text.find("DATA"); (at = text.find(" 4278", at)) != std::string::npos;) {
    text.replace(at, text.find('\n', at) - at, " 7");
  }
  const ScratchFolder folder;
  folder.write("a.pcd", text);
  const auto frame = open_dataset(options_for(folder))->next();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->color.empty());
  EXPECT_EQ(frame->labels.at<std::uint16_t>(3, 4), 2);
}

TEST(PcdReader, ReadsTheTable) {
  const std::filesystem::path table = std::filesystem::path(POCD_TEST_DATA) / "tabletop_states";
  if (!std::filesystem::exists(table)) GTEST_SKIP() << table << " is not there";
  DatasetOptions options;
  options.format = DatasetFormat::kPcd;
  options.inputs = {table};
  options.camera = CameraModel{640, 480, 525, 525, 319.5, 239.5};
  Pose T_W_C = Pose::Identity();
  T_W_C.translation() = Eigen::Vector3d(0.03279, -0.58779, 0.58668);
  T_W_C.linear() =
      Eigen::Quaterniond(-0.406181, 0.913791, -0.000693, -0.001558).normalized().toRotationMatrix();
  options.T_W_C = T_W_C;
  const auto reader = open_dataset(options);
  const std::vector<Frame> frames = read_all(*reader);
  ASSERT_EQ(frames.size(), 11u);
  EXPECT_TRUE(reader->problems().empty());
  for (const Frame& frame : frames) {
    double squares = 0.0, count = 0.0;
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const float z = frame.depth_m.at<float>(v, u);
        if (z == 0.0f || frame.labels.at<std::uint16_t>(v, u) != 1) continue;
        const Eigen::Vector3d p_W = frame.T_W_C * frame.camera.back_project(u, v, z);
        squares += p_W.z() * p_W.z(), count += 1.0;
      }
    }
    // The table is at z = 0; its listed residual is 1.9 mm rms in every state.
    EXPECT_GT(count, 50000);
    EXPECT_LT(std::sqrt(squares / count), 0.003) << frame.sequence;
  }
}

}  // namespace
}  // namespace pocd

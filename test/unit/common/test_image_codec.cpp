// PNG and JPEG against OpenCV's module for image files.
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "pocd/common/check.hpp"
#include "pocd/common/image_codec.hpp"
#include "pocd/common/random.hpp"
#include "run_command.hpp"

namespace pocd {
namespace {

constexpr int kSide = 100;

using Bytes = std::vector<std::uint8_t>;

cv::Mat picture(int rows, int cols, int type, std::uint64_t seed) {
  Random random(seed);
  cv::Mat out(rows, cols, type);
  for (int row = 0; row < rows; ++row) {
    std::uint8_t* at = out.ptr(row);
    for (std::size_t i = 0; i < out.elemSize() * static_cast<std::size_t>(cols); ++i) {
      at[i] = static_cast<std::uint8_t>(random.below(256));
    }
  }
  return out;
}

Bytes coded(const char* extension, const cv::Mat& image, const std::vector<int>& options = {}) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes, options));
  return bytes;
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

TEST(ImageCodec, PngIsReadAsOpenCvReadsIt) {
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3, CV_8UC4, CV_16UC4}) {
    const cv::Mat image = picture(17, 23, type, static_cast<std::uint64_t>(type));
    const Bytes bytes = coded(".png", image);
    EXPECT_TRUE(same(decode_png(bytes.data(), bytes.size(), kSide), image)) << type;
  }
  // One bit a pixel, as masks may have.
  cv::Mat mask(9, 13, CV_8UC1, cv::Scalar(0));
  mask(cv::Rect(3, 2, 5, 4)).setTo(255);
  const Bytes bytes = coded(".png", mask, {cv::IMWRITE_PNG_BILEVEL, 1});
  EXPECT_TRUE(same(decode_png(bytes.data(), bytes.size(), kSide), mask));
}

TEST(ImageCodec, JpegIsReadAsOpenCvReadsIt) {
  for (const int type : {CV_8UC1, CV_8UC3}) {
    cv::Mat image(64, 48, type, cv::Scalar(20, 90, 200));
    image.rowRange(20, 40).setTo(cv::Scalar(180, 30, 60));
    for (const int progressive : {0, 1}) {
      const Bytes bytes = coded(".jpg", image, {cv::IMWRITE_JPEG_PROGRESSIVE, progressive});
      EXPECT_TRUE(same(decode_jpeg(bytes.data(), bytes.size(), kSide),
                       cv::imdecode(bytes, cv::IMREAD_UNCHANGED)))
          << type;
    }
  }
}

TEST(ImageCodec, WhatIsCutOffIsNoPicture) {
  const cv::Mat image = picture(40, 40, CV_8UC3, 4);
  for (const char* extension : {".png", ".jpg"}) {
    const Bytes whole = coded(extension, image);
    for (const double share : {0.0, 0.01, 0.3, 0.9}) {
      const auto size = static_cast<std::size_t>(share * static_cast<double>(whole.size()));
      const cv::Mat read = extension == std::string(".png")
                               ? decode_png(whole.data(), size, kSide)
                               : decode_jpeg(whole.data(), size, kSide);
      EXPECT_TRUE(read.empty()) << extension << " of " << size << " bytes";
    }
  }
}

TEST(ImageCodec, WhatIsTooLargeIsNoPicture) {
  for (const char* extension : {".png", ".jpg"}) {
    const Bytes bytes = coded(extension, picture(10, kSide + 1, CV_8UC1, 3));
    const auto decode = extension == std::string(".png") ? decode_png : decode_jpeg;
    EXPECT_TRUE(decode(bytes.data(), bytes.size(), kSide).empty()) << extension;
    EXPECT_FALSE(decode(bytes.data(), bytes.size(), kSide + 1).empty()) << extension;
  }
}

// Under the sanitizers this reads and writes nothing beyond its memory; nothing is said on stderr.
TEST(ImageCodec, DamageEndsNothing) {
  Random random(5);
  ::testing::internal::CaptureStderr();
  for (int trial = 0; trial < 4000; ++trial) {
    const bool png = trial % 2 == 0;
    Bytes bytes = coded(png ? ".png" : ".jpg", picture(12, 12, trial % 3 ? CV_8UC3 : CV_8UC1, 6));
    for (int i = 0; i < 3; ++i) {
      const std::size_t at = 33 + random.below(bytes.size() - 33);
      bytes[at] = static_cast<std::uint8_t>(random.below(256));
    }
    if (png) {
      decode_png(bytes.data(), bytes.size(), kSide);
    } else if (const cv::Mat read = decode_jpeg(bytes.data(), bytes.size(), kSide); !read.empty()) {
      EXPECT_EQ(read.depth(), CV_8U);
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(ImageCodec, WritesWhatCanBeReadOrNamesTheFile) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "a.png";
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_8UC4}) {
    const cv::Mat image = picture(31, 7, type, 7);
    write_png(file, image);
    EXPECT_TRUE(same(cv::imread(file.string(), cv::IMREAD_UNCHANGED), image)) << type;
  }
  try {
    write_png(folder.path() / "absent/b.png", picture(2, 2, CV_8UC1, 8));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("absent/b.png"), std::string::npos);
  }
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_THROW(write_png("/dev/full", picture(2, 2, CV_8UC1, 9)), InputError);
  }
}

}  // namespace
}  // namespace pocd

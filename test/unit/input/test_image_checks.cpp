// Images as drivers and image_transport send them.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "pocd/common/random.hpp"
#include "pocd/input/message_checks.hpp"

namespace pocd {
namespace {

using Bytes = std::vector<std::uint8_t>;

ImageView raw(const Bytes& data, std::uint32_t width, std::uint32_t height, std::uint32_t step,
              const char* encoding, bool big_endian = false) {
  return {width, height, encoding, big_endian, step, data.data(), data.size(), false};
}
ImageView packed(const Bytes& data, const char* format) {
  ImageView view;
  view.encoding = format;
  view.data = data.data();
  view.size = data.size();
  view.compressed = true;
  return view;
}

Bytes picture(const cv::Mat& image, const char* extension) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes));
  return bytes;
}

/// 12 bytes of header: the quantisation's kind and its two parameters.
Bytes with_header(float a, float b, const Bytes& rest) {
  Bytes bytes(12 + rest.size(), 0);
  std::memcpy(bytes.data() + 4, &a, 4);
  std::memcpy(bytes.data() + 8, &b, 4);
  std::copy(rest.begin(), rest.end(), bytes.begin() + 12);
  return bytes;
}

/// RVL as its paper has it, written here for the test only.
Bytes rvl(const cv::Mat& depth) {
  Bytes bytes(8);
  const std::int32_t cols = depth.cols, rows = depth.rows;
  std::memcpy(bytes.data(), &cols, 4);
  std::memcpy(bytes.data() + 4, &rows, 4);
  std::uint32_t word = 0;
  int nibbles = 0;
  const auto nibble = [&](std::uint32_t value) {
    word = word << 4 | value;
    if (++nibbles < 8) return;
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<std::uint8_t>(word >> (8 * i)));
    word = 0;
    nibbles = 0;
  };
  const auto number = [&](std::uint32_t value) {
    do {
      const std::uint32_t low = value & 7;
      value >>= 3;
      nibble(value ? low | 8 : low);
    } while (value);
  };
  const std::vector<std::uint16_t> pixels(depth.begin<std::uint16_t>(), depth.end<std::uint16_t>());
  int previous = 0;
  for (std::size_t at = 0; at < pixels.size();) {
    std::size_t zeros = at;
    while (zeros < pixels.size() && pixels[zeros] == 0) ++zeros;
    number(static_cast<std::uint32_t>(zeros - at));
    std::size_t end = zeros;
    while (end < pixels.size() && pixels[end] != 0) ++end;
    number(static_cast<std::uint32_t>(end - zeros));
    for (; zeros < end; ++zeros) {
      const int difference = pixels[zeros] - previous;
      previous = pixels[zeros];
      number(static_cast<std::uint32_t>(difference * 2 ^ difference >> 31));
    }
    at = end;
  }
  while (nibbles != 0) nibble(0);
  return bytes;
}

cv::Mat some_depth(std::uint64_t seed) {
  Random random(seed);
  cv::Mat depth(30, 40, CV_16UC1, cv::Scalar(0));
  for (auto it = depth.begin<std::uint16_t>(); it != depth.end<std::uint16_t>(); ++it) {
    if (random.uniform() < 0.7) *it = static_cast<std::uint16_t>(random.below(65536));
  }
  return depth;
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && cv::countNonZero(a != b) == 0;
}

TEST(DepthImage, BigEndianIsReadAsItIsMeant) {
  const auto words = depth_image(raw({0x05, 0xDC, 0x01, 0x02}, 2, 1, 4, "16UC1", true));
  ASSERT_TRUE(words.value);
  EXPECT_EQ(words.value->at<std::uint16_t>(0, 0), 1500);
  EXPECT_EQ(words.value->at<std::uint16_t>(0, 1), 258);
  const auto metres = depth_image(raw({0x3F, 0xC0, 0, 0}, 1, 1, 4, "32FC1", true));
  ASSERT_TRUE(metres.value);
  EXPECT_EQ(metres.value->at<float>(0, 0), 1.5f);
}

TEST(DepthImage, CompressedDepthIsReadInAllItsForms) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const cv::Mat depth = some_depth(seed);
    for (const char* format : {"16UC1; compressedDepth", "16UC1; compressedDepth png"}) {
      const auto png = depth_image(packed(with_header(0, 0, picture(depth, ".png")), format));
      ASSERT_TRUE(png.value) << png.problem->detail;
      EXPECT_TRUE(same(*png.value, depth));
    }
    const auto packed_rvl =
        depth_image(packed(with_header(0, 0, rvl(depth)), "16UC1; compressedDepth rvl"));
    ASSERT_TRUE(packed_rvl.value) << packed_rvl.problem->detail;
    EXPECT_TRUE(same(*packed_rvl.value, depth)) << seed;
    const auto plain = depth_image(packed(picture(depth, ".png"), "16UC1; png compressed "));
    ASSERT_TRUE(plain.value);
    EXPECT_TRUE(same(*plain.value, depth));
  }
}

// Not everybody writes header and format as image_transport does.
TEST(DepthImage, CompressedDepthIsReadWhateverItsFormatSays) {
  const cv::Mat depth(6, 8, CV_16UC1, cv::Scalar(1234));
  const std::vector<std::uint8_t> png = picture(depth, ".png");
  for (const char* format : {"", "png", "16UC1; compressedDepth", "16UC1; compresseddepth PNG"}) {
    for (const auto& data : {png, with_header(0, 0, png)}) {
      const auto image = depth_image(packed(data, format));
      ASSERT_TRUE(image.value) << format << ": " << image.problem->detail;
      EXPECT_TRUE(same(*image.value, depth)) << format;
    }
  }
}

// The parameters of image_transport's default: depths up to 10 m, 100 m of quantisation.
TEST(DepthImage, InverseDepthIsMetresAgain) {
  const float a = 100.0f * 101.0f, b = 1.0f - a / 10.0f;
  cv::Mat inverse(1, 3, CV_16UC1);
  const float metres[] = {1.0f, 2.5f};
  inverse.at<std::uint16_t>(0, 0) = static_cast<std::uint16_t>(a / metres[0] + b);
  inverse.at<std::uint16_t>(0, 1) = static_cast<std::uint16_t>(a / metres[1] + b);
  inverse.at<std::uint16_t>(0, 2) = 0;
  for (const bool with_rvl : {false, true}) {
    const auto depth =
        depth_image(packed(with_header(a, b, with_rvl ? rvl(inverse) : picture(inverse, ".png")),
                           with_rvl ? "32FC1; compressedDepth rvl" : "32FC1; compressedDepth png"));
    ASSERT_TRUE(depth.value) << depth.problem->detail;
    ASSERT_EQ(depth.value->type(), CV_32FC1);
    // One step of the quantisation is metres^2 / a.
    EXPECT_NEAR(depth.value->at<float>(0, 0), metres[0], metres[0] * metres[0] / a);
    EXPECT_NEAR(depth.value->at<float>(0, 1), metres[1], metres[1] * metres[1] / a);
    EXPECT_EQ(depth.value->at<float>(0, 2), 0.0f) << "no return";
  }
}

TEST(DepthImage, DamagedCompressionIsNamedAndNeverReadBeyond) {
  Random random(3);
  const cv::Mat depth = some_depth(1);
  for (int trial = 0; trial < 3000; ++trial) {
    const bool with_rvl = trial % 2 == 0;
    Bytes bytes = with_header(100, -9, with_rvl ? rvl(depth) : picture(depth, ".png"));
    bytes.resize(random.below(bytes.size() + 1));
    for (int i = 0; i < 3 && !bytes.empty(); ++i) {
      bytes[random.below(bytes.size())] = static_cast<std::uint8_t>(random.below(256));
    }
    const auto read = depth_image(
        packed(bytes, with_rvl ? "16UC1; compressedDepth rvl" : "16UC1; compressedDepth png"));
    EXPECT_TRUE(read.value || !read.problem->detail.empty());
  }
  const auto jpeg =
      depth_image(packed(with_header(0, 0, picture(cv::Mat(9, 9, CV_8UC1, cv::Scalar(3)), ".jpg")),
                         "16UC1; compressedDepth"));
  ASSERT_TRUE(jpeg.problem);
  EXPECT_STREQ(to_string(jpeg.problem->reason), "bad_compression");
  const auto nothing = depth_image(packed(Bytes(600, 5), "16UC1; compressedDepth"));
  ASSERT_TRUE(nothing.problem);
  EXPECT_NE(nothing.problem->detail.find("neither PNG nor JPEG"), std::string::npos);
}

ClassMap coloured_classes() {
  ClassMap map;
  map.list = {{0, "none", ClassRole::kBackground, 1, "0,0,0"},
              {7, "box", ClassRole::kObject, 0, "0,153,153"},
              {300, "far", ClassRole::kBackground, 1, "255,0,102"}};
  return map;
}

TEST(LabelImage, ColoursMayHaveFourChannels) {
  const LabelTable table(coloured_classes());
  const auto rgba = label_image(raw({0, 153, 153, 255, 255, 0, 102, 9}, 2, 1, 8, "rgba8"), table);
  ASSERT_TRUE(rgba.value);
  EXPECT_EQ(rgba.value->labels.at<std::uint16_t>(0, 0), 7);
  EXPECT_EQ(rgba.value->labels.at<std::uint16_t>(0, 1), 300);
  const auto bgra = label_image(raw({153, 153, 0, 255, 102, 0, 255, 9}, 2, 1, 8, "bgra8"), table);
  ASSERT_TRUE(bgra.value);
  EXPECT_EQ(bgra.value->labels.at<std::uint16_t>(0, 1), 300);
  const auto color = color_image(raw({1, 2, 3, 255}, 1, 1, 4, "rgba8"));
  ASSERT_TRUE(color.value);
  EXPECT_EQ(color.value->at<cv::Vec3b>(0, 0), cv::Vec3b(3, 2, 1));
}

TEST(LabelImage, IdsOf32BitsAreReadAndUnlistedOnesCounted) {
  const LabelTable table(coloured_classes());
  Bytes data(16);
  const std::int32_t ids[] = {7, 300, -1, 70000};
  std::memcpy(data.data(), ids, 16);
  const auto mask = label_image(raw(data, 4, 1, 16, "32SC1"), table);
  ASSERT_TRUE(mask.value);
  EXPECT_EQ(mask.value->labels.at<std::uint16_t>(0, 1), 300);
  EXPECT_EQ(mask.value->unlisted_pixels, 2u);
  EXPECT_EQ(mask.value->unlisted, (std::vector<std::int64_t>{-1, 70000})) << "as they were sent";
  const auto swapped = label_image(raw({0, 0, 0, 7}, 1, 1, 4, "32SC1", true), table);
  ASSERT_TRUE(swapped.value);
  EXPECT_EQ(swapped.value->labels.at<std::uint16_t>(0, 0), 7);
  EXPECT_EQ(swapped.value->unlisted_pixels, 0u);
}

TEST(LabelImage, PngKeepsIdsAndJpegFindsTheNearestColour) {
  const LabelTable table(coloured_classes());
  cv::Mat ids(16, 16, CV_16UC1, cv::Scalar(300));
  ids.rowRange(0, 8).setTo(7);
  const auto png = label_image(packed(picture(ids, ".png"), "16UC1; png compressed "), table);
  ASSERT_TRUE(png.value);
  EXPECT_TRUE(same(png.value->labels, ids));
  cv::Mat colours(32, 32, CV_8UC3, cv::Scalar(102, 0, 255));  // BGR
  colours.rowRange(0, 16).setTo(cv::Scalar(153, 153, 0));
  const auto jpeg =
      label_image(packed(picture(colours, ".jpg"), "rgb8; jpeg compressed bgr8"), table);
  ASSERT_TRUE(jpeg.value);
  EXPECT_EQ(jpeg.value->labels.at<std::uint16_t>(4, 4), 7);
  EXPECT_EQ(jpeg.value->labels.at<std::uint16_t>(28, 4), 300);
  // Colour has half the resolution: a row on each side of the edge is a mixture.
  EXPECT_LE(jpeg.value->unknown_pixels, 64u);
}

TEST(LabelImage, AGreyJpegIsRefusedAndUnknownColoursAreNamed) {
  const LabelTable table(coloured_classes());
  const cv::Mat ids(16, 16, CV_8UC1, cv::Scalar(7));
  const auto jpeg =
      label_image(packed(picture(ids, ".jpg"), "mono8; jpeg compressed mono8"), table);
  ASSERT_TRUE(jpeg.problem) << "its values are no ids any more";
  EXPECT_EQ(jpeg.problem->reason, InputReason::kBadCompression);
  EXPECT_NE(jpeg.problem->detail.find("send masks as PNG"), std::string::npos);
  const auto mask = label_image(raw({1, 2, 3, 1, 2, 3, 4, 5, 6}, 3, 1, 9, "rgb8"), table);
  ASSERT_TRUE(mask.value);
  EXPECT_EQ(mask.value->unknown_pixels, 3u);
  EXPECT_EQ(mask.value->unknown, (std::vector<std::string>{"1,2,3", "4,5,6"}));
}

TEST(ResizedTo, TakesThePixelBelowTheCentre) {
  cv::Mat fine(2, 4, CV_16UC1);
  for (int i = 0; i < 8; ++i) fine.at<std::uint16_t>(i / 4, i % 4) = static_cast<std::uint16_t>(i);
  const auto coarse = resized_to(fine, 2, 1);
  ASSERT_TRUE(coarse);
  EXPECT_EQ(coarse->at<std::uint16_t>(0, 0), 5);
  EXPECT_EQ(coarse->at<std::uint16_t>(0, 1), 7);
  const auto finer = resized_to(fine, 8, 4);
  ASSERT_TRUE(finer);
  EXPECT_EQ(finer->at<std::uint16_t>(0, 1), 0);
  EXPECT_EQ(finer->at<std::uint16_t>(3, 7), 7);
  EXPECT_FALSE(resized_to(fine, 2, 2));
}

TEST(CameraModelOf, RegionAndBinningAreThoseOfImageGeometry) {
  CameraInfoFields info;
  info.width = 640;
  info.height = 480;
  info.k = {500, 0, 320, 0, 510, 240, 0, 0, 1};
  EXPECT_EQ(*camera_model(info).value, (CameraModel{640, 480, 500, 510, 320, 240}));
  info.binning_x = info.binning_y = 2;
  EXPECT_EQ(*camera_model(info).value, (CameraModel{320, 240, 250, 255, 160, 120}));
  info.roi_x = 100;
  info.roi_y = 40;
  info.roi_width = 400;
  info.roi_height = 300;
  EXPECT_EQ(*camera_model(info).value, (CameraModel{200, 150, 250, 255, 110, 100}));
  info.binning_x = info.binning_y = 1000;
  ASSERT_TRUE(camera_model(info).problem);
  EXPECT_EQ(camera_model(info).problem->reason, InputReason::kBadImageSize);
}

// As image_geometry: of a rectified image P says what it is projected by.
TEST(CameraModelOf, OfALensThatDistortsTheProjectionCounts) {
  CameraInfoFields info;
  info.width = 640;
  info.height = 480;
  info.k = {500, 0, 320, 0, 510, 240, 0, 0, 1};
  info.p = {400, 0, 310, 0, 0, 410, 230, 0, 0, 0, 1, 0};
  const CameraModel lens{640, 480, 500, 510, 320, 240}, rectified{640, 480, 400, 410, 310, 230};
  EXPECT_EQ(*camera_model(info).value, lens) << "nothing was rectified";
  info.distorted = true;
  EXPECT_EQ(*camera_model(info).value, rectified);
  info.p[0] = std::nan("");
  EXPECT_EQ(*camera_model(info).value, lens);
  info.p[0] = 400;
  info.k = {};
  ASSERT_TRUE(camera_model(info).problem);
  EXPECT_EQ(camera_model(info).problem->reason, InputReason::kZeroFocalLength);
}

}  // namespace
}  // namespace pocd

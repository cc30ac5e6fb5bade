#include "pocd/network/segmentation_network.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/core.hpp>

#include "every_choice.hpp"
#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/network/network_config.hpp"
#include "pocd/pipeline/pipeline_config.hpp"
#include "run_command.hpp"
#include "tiny_onnx.hpp"

namespace pocd {
namespace {

constexpr int kWidth = 6, kHeight = 4;

ClassMap classes() {
  ClassMap map;
  map.list = {{0, "other", ClassRole::kBackground, 1, ""},
              {3, "red_thing", ClassRole::kObject, 0, ""},
              {5, "green_thing", ClassRole::kObject, 0, ""},
              {9, "blue_thing", ClassRole::kObject, 0, ""}};
  return map;
}

/// The largest of red, green and blue is the class, in the input's own order of channels.
const std::vector<std::vector<float>> kLargest{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

class Network : public ::testing::Test {
 protected:
  std::filesystem::path model() const { return folder_.path() / "net.onnx"; }
  std::string file() const { return (folder_.path() / "net.yaml").string(); }

  void describe(const std::string& more,
                const std::string& names = "[red_thing, green_thing, blue_thing]") {
    std::ofstream(file()) << "network:\n  input_width_px: 6\n  input_height_px: 4\n  classes: "
                          << names << "\n"
                          << more;
  }
  cv::Mat run(const cv::Mat& color, const ClassMap& map = classes()) {
    return SegmentationNetwork(model(), map, 1).labels(color);
  }
  /// What the constructor says; "" when it takes the network.
  std::string refusal(const ClassMap& map = classes()) {
    try {
      SegmentationNetwork(model(), map, 1);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  void expect_refusal(const std::vector<std::string>& parts) {
    const std::string said = refusal();
    for (const std::string& part : parts) {
      EXPECT_NE(said.find(part), std::string::npos) << "\"" << part << "\" is not in: " << said;
    }
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }

  TemporaryFolder folder_;
};

/// Red left, blue right, in OpenCV's order.
cv::Mat red_and_blue(int width = kWidth, int height = kHeight) {
  cv::Mat image(height, width, CV_8UC3, cv::Scalar(0, 0, 200));
  image.colRange(width / 2, width).setTo(cv::Scalar(200, 0, 0));
  return image;
}

TEST_F(Network, LogitsBecomeTheIdsOfTheNamedClasses) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  describe("");
  const cv::Mat labels = run(red_and_blue());
  ASSERT_EQ(labels.type(), CV_16UC1);
  ASSERT_EQ(labels.size(), cv::Size(kWidth, kHeight));
  EXPECT_EQ(cv::countNonZero(labels.colRange(0, 3) != 3), 0) << labels;
  EXPECT_EQ(cv::countNonZero(labels.colRange(3, 6) != 9), 0) << labels;
}

TEST_F(Network, TheChannelOrderIsThatOfTheFile) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  describe("  channel_order: bgr\n");
  const cv::Mat labels = run(red_and_blue());
  EXPECT_EQ(cv::countNonZero(labels.colRange(0, 3) != 9), 0) << labels;
  EXPECT_EQ(cv::countNonZero(labels.colRange(3, 6) != 3), 0) << labels;
}

TEST_F(Network, MeanAndScaleAreThoseOfTheFile) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  // Of (0, 0, 200): red 20, green 30.
  describe("  mean: {red: 190, green: -30}\n  scale: {red: 2, green: 1, blue: 1}\n");
  EXPECT_EQ(cv::countNonZero(run(cv::Mat(4, 6, CV_8UC3, cv::Scalar(0, 0, 200))) != 5), 0);
  describe("  mean: {red: 190, green: -30}\n  scale: {red: 4, green: 1, blue: 1}\n");
  EXPECT_EQ(cv::countNonZero(run(cv::Mat(4, 6, CV_8UC3, cv::Scalar(0, 0, 200))) != 3), 0);
}

TEST_F(Network, ImagesOfAnotherSizeKeepTheirSize) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  describe("");
  const cv::Mat labels = run(red_and_blue(60, 44));
  ASSERT_EQ(labels.size(), cv::Size(60, 44));
  // Colours mix within one pixel of the network, which is 10 wide.
  EXPECT_EQ(cv::countNonZero(labels.colRange(0, 25) != 3), 0);
  EXPECT_EQ(cv::countNonZero(labels.colRange(35, 60) != 9), 0);
}

TEST_F(Network, ChannelsMayComeLast) {
  TinyOnnx onnx({1, kHeight, kWidth, 3}, kLargest);
  onnx.nodes = {TinyOnnx::transpose("image", "planes", {0, 3, 1, 2}),
                TinyOnnx::convolve("planes", "logits"),
                TinyOnnx::transpose("logits", "classes", {0, 2, 3, 1})};
  onnx.write(model());
  describe("  layout: nhwc\n");
  const cv::Mat labels = run(red_and_blue());
  EXPECT_EQ(cv::countNonZero(labels.colRange(0, 3) != 3), 0) << labels;
  EXPECT_EQ(cv::countNonZero(labels.colRange(3, 6) != 9), 0) << labels;
}

TEST_F(Network, ClassNumbersAreTakenAsTheyAre) {
  TinyOnnx onnx = TinyOnnx::convolution(kWidth, kHeight, kLargest);
  onnx.nodes = {TinyOnnx::convolve("image", "logits"), TinyOnnx::arg_max("logits", "classes")};
  onnx.write(model());
  describe("  output: class_ids\n");
  const cv::Mat labels = run(red_and_blue(12, 8));
  EXPECT_EQ(cv::countNonZero(labels.colRange(0, 6) != 3), 0) << labels;
  EXPECT_EQ(cv::countNonZero(labels.colRange(6, 12) != 9), 0) << labels;
}

TEST_F(Network, TheDivisorOfInstancesIsApplied) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  describe("");
  ClassMap map = classes();
  map.label_divisor = 100;
  EXPECT_EQ(run(red_and_blue(), map).at<std::uint16_t>(0, 0), 300);
}

TEST_F(Network, ThreadsChangeNothing) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  describe("");
  cv::Mat noise(97, 131, CV_8UC3);
  cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 256);
  const cv::Mat one = SegmentationNetwork(model(), classes(), 1).labels(noise);
  const cv::Mat two = SegmentationNetwork(model(), classes(), 2).labels(noise);
  EXPECT_EQ(cv::countNonZero(one != two), 0);
}

TEST_F(Network, AnOperatorThatOpenCvHasNotIsNamed) {
  TinyOnnx onnx = TinyOnnx::convolution(kWidth, kHeight, kLargest);
  onnx.nodes = {TinyOnnx::convolve("image", "logits"), {"GridSample", {"logits"}, "last_layer"}};
  onnx.write(model());
  describe("");
  expect_refusal({model().string(), "GridSample", "last_layer"});
}

TEST_F(Network, WhatIsNoModelIsRefused) {
  describe("");
  expect_refusal({model().string() + ": is no file"});
  std::ofstream(model()) << "hello";
  expect_refusal({model().string(), "OpenCV cannot load"});
}

TEST_F(Network, TheOutputHasToFitTheFile) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  describe("", "[red_thing, green_thing]");
  expect_refusal({"1x3x4x6", "1x2xHEIGHTxWIDTH", file()});
  describe("  output: class_ids\n");
  expect_refusal({"1x3x4x6", "one plane of class numbers"});
  describe("  layout: nhwc\n");
  expect_refusal({"OpenCV cannot run the network"});
}

TEST_F(Network, ClassNumbersBeyondTheListAreRefused) {
  TinyOnnx onnx = TinyOnnx::convolution(kWidth, kHeight, kLargest);
  onnx.nodes = {TinyOnnx::convolve("image", "logits"), TinyOnnx::arg_max("logits", "classes")};
  onnx.write(model());
  describe("  output: class_ids\n", "[red_thing, green_thing]");
  SegmentationNetwork network(model(), classes(), 1);
  EXPECT_THROW(network.labels(red_and_blue()), InputError);
}

TEST_F(Network, MistakesInTheFileAreNamed) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  expect_refusal({file(), "cannot be read"});
  describe("", "[red_thing, crate, blue_thing]");
  expect_refusal({file(), "network.classes[1]", "crate", "classes.list"});
  std::ofstream(file()) << "network: {input_width_px: 6, classes: [red_thing]}\n";
  expect_refusal({"input_height_px", "0"});
  describe("  channel_order: gbr\n");
  expect_refusal({file(), "channel_order", "gbr"});
}

TEST(NetworkChoices, AreChecked) {
  EXPECT_EQ(
      test::try_every_choice<NetworkFile>(),
      (std::vector<std::string>{"network.channel_order", "network.layout", "network.output"}));
}

class Frames : public DatasetReader {
 public:
  std::optional<Frame> next() override {
    if (at_ == 3) return std::nullopt;
    if (at_ == 1) skip("a bad one");
    Frame frame;
    frame.sequence = at_++;
    if (frame.sequence != 2) frame.color = red_and_blue();
    return frame;
  }
  std::size_t size() const override { return 3; }

 private:
  std::uint64_t at_ = 0;
};

TEST_F(Network, ADataSetGetsItsLabels) {
  TinyOnnx::convolution(kWidth, kHeight, kLargest).write(model());
  describe("");
  const auto reader = segmented(std::make_unique<Frames>(),
                                std::make_shared<SegmentationNetwork>(model(), classes(), 1));
  EXPECT_EQ(reader->size(), 3u);
  for (int i = 0; i < 2; ++i) {
    const auto frame = reader->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->labels.at<std::uint16_t>(0, 0), 3);
  }
  EXPECT_FALSE(reader->next());
  EXPECT_EQ(reader->skipped(), 2u);
  EXPECT_EQ(reader->problems(),
            (std::vector<std::string>{"a bad one", "frame 2: no colour image for the network"}));
}

TEST(TorwicNetwork, ClassesAreThoseOfTheDataSetInItsOrder) {
  const std::filesystem::path config = std::filesystem::path(POCD_SOURCE_DIR) / "config";
  PipelineConfig pipeline;
  load_config(pipeline, {config / "torwic.yaml"});
  NetworkFile file;
  load_config(file, {config / "networks" / "torwic_deploy_model.yaml"},
              {"network.input_width_px=640", "network.input_height_px=480"});
  ASSERT_EQ(file.network.classes.size(), pipeline.classes.list.size());
  for (std::size_t i = 0; i < pipeline.classes.list.size(); ++i) {
    EXPECT_EQ(file.network.classes[i], pipeline.classes.name(static_cast<ClassId>(i)));
  }
}

}  // namespace
}  // namespace pocd

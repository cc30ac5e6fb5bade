// pocd_segment: colour images of the bus in, class masks out; and the network in pocd_play.
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/core.hpp>

#include "robot_sender.hpp"
#include "tiny_onnx.hpp"
#include "whole_run.hpp"

namespace pocd {
namespace {

/// A network in a folder: the largest of red, green and blue says fence (4), box (7) or
/// cart_pallet_jack (9).
class NetworkFolder {
 public:
  explicit NetworkFolder(int width = 30, int height = 20) {
    TinyOnnx::convolution(width, height, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}).write(model());
    std::ofstream(folder_.path() / "net.yaml")
        << "network:\n  input_width_px: " << width << "\n  input_height_px: " << height
        << "\n  classes: [fence, box, cart_pallet_jack]\n";
  }
  std::string model() const { return (folder_.path() / "net.onnx").string(); }
  const std::filesystem::path& path() const { return folder_.path(); }

 private:
  TemporaryFolder folder_;
};

std::vector<std::string> segment_command(const TestDomain& domain, const NetworkFolder& network,
                                         const std::vector<std::string>& more = {}) {
  std::vector<std::string> command{
      bin("pocd_segment"), "--config",      source("config/simulated.yaml"),
      "--network",         network.model(), "--domain",
      domain.text()};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

/// Images with earlier stamps are probes.
constexpr StampNs kFirstStampNs = 10'000;

/// What pocd_segment says at its end.
struct SegmentCounts {
  unsigned long masks = 0, images = 0, dropped = 0, refused = 0;
};

SegmentCounts counts_of(const CommandResult& result) {
  SegmentCounts counts;
  EXPECT_EQ(
      std::sscanf(result.out.c_str(), "%lu masks sent of %lu images, %lu dropped, %lu refused",
                  &counts.masks, &counts.images, &counts.dropped, &counts.refused),
      4)
      << result.out;
  return counts;
}

/// The camera of a robot, and who hears its masks.
class Colours {
 public:
  Colours(const std::shared_ptr<dds::Participant>& bus, const std::string& robot)
      : masks_(bus, dds::topics::kSegmentation, "rt/" + robot + "/segmentation",
               dds::Delivery{true, false, 0, 0, 0, false, 0}, wakeup_),
        colors_(bus, dds::topics::kColor, "rt/" + robot + "/color/image_raw", kTestDelivery) {}

  /// To be asked until it is true: from then on each image is heard and its mask comes back. That
  /// this side has found the other one does not say that the other one has found this side, and
  /// nothing is kept for late joiners; so it sends probes (stamps below kFirstStampNs).
  bool connected() {
    if (colors_.matched() == 0 || masks_.matched() == 0) return false;
    if (probes_ + 1 < kFirstStampNs) send(++probes_, {0, 0, 0});
    sensor_msgs::msg::Image mask;
    dds::SampleMeta meta;
    while (masks_.take(mask, meta)) {
      if (meta.valid) return true;
    }
    return false;
  }
  /// To a node that hears the masks; the masks are not heard here.
  bool matched() const { return colors_.matched() > 0; }
  std::uint64_t probes() const { return static_cast<std::uint64_t>(probes_); }
  void send(StampNs stamp_ns, const cv::Scalar& bgr, cv::Size size = {30, 20}) {
    auto image = dds::image_message(cv::Mat(size, CV_8UC3, bgr), "bgr8", stamp_ns,
                                    "frame_" + std::to_string(stamp_ns));
    EXPECT_TRUE(colors_.write(image));
  }
  void send_depth_by_mistake(StampNs stamp_ns) {
    auto image = dds::image_message(cv::Mat(2, 3, CV_16UC1, cv::Scalar(1)), "16UC1", stamp_ns, "");
    EXPECT_TRUE(colors_.write(image));
  }
  /// Those of images that are no probes.
  std::vector<sensor_msgs::msg::Image>& masks() {
    sensor_msgs::msg::Image mask;
    dds::SampleMeta meta;
    while (masks_.take(mask, meta)) {
      if (meta.valid && dds::to_stamp(mask.header().stamp()) >= kFirstStampNs) {
        taken_.push_back(mask);
      }
    }
    return taken_;
  }

 private:
  StampNs probes_ = 0;
  dds::Wakeup wakeup_;
  std::vector<sensor_msgs::msg::Image> taken_;
  dds::Reader<sensor_msgs::msg::ImagePubSubType> masks_;
  dds::Writer<sensor_msgs::msg::ImagePubSubType> colors_;
};

TEST(Segment, EachMaskHasStampFrameAndSizeOfItsImage) {
  const TestDomain domain;
  const NetworkFolder network;
  const auto bus = test_participant(domain);
  Colours robot(bus, "robot1");
  Process segment(segment_command(domain, network, {"--lossless"}));
  ASSERT_TRUE(eventually([&] { return robot.connected(); })) << segment.err();
  const std::vector<cv::Scalar> colours{{0, 0, 200}, {0, 200, 0}, {200, 0, 0}};
  constexpr int kImages = 30;
  for (int i = 0; i < kImages; ++i) {
    robot.send(kFirstStampNs + i, colours[static_cast<std::size_t>(i % 3)]);
  }
  robot.send_depth_by_mistake(2 * kFirstStampNs);
  ASSERT_TRUE(eventually([&] { return robot.masks().size() == kImages; })) << segment.err();
  const std::uint8_t ids[] = {4, 7, 9};
  for (int i = 0; i < kImages; ++i) {
    const auto& mask = robot.masks()[static_cast<std::size_t>(i)];
    EXPECT_EQ(dds::to_stamp(mask.header().stamp()), kFirstStampNs + i);
    EXPECT_EQ(mask.header().frame_id(), "frame_" + std::to_string(kFirstStampNs + i));
    EXPECT_EQ(mask.encoding(), "mono8");
    EXPECT_EQ(mask.width(), 30u);
    EXPECT_EQ(mask.height(), 20u);
    EXPECT_EQ(mask.data(), std::vector<std::uint8_t>(600, ids[i % 3])) << i;
  }
  ASSERT_TRUE(eventually([&] {
    return segment.err().find("unknown_encoding") != std::string::npos;
  })) << segment.err();
  segment.signal(SIGTERM);
  const CommandResult result = segment.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err.find("two_sources"), std::string::npos) << result.err;
  const SegmentCounts counts = counts_of(result);
  EXPECT_GT(counts.masks, static_cast<unsigned long>(kImages)) << "with the probes";
  EXPECT_LE(counts.masks, kImages + robot.probes());
  EXPECT_EQ(counts.images, counts.masks + 1);
  EXPECT_EQ(counts.dropped, 0u);
  EXPECT_EQ(counts.refused, 1u);
}

// A network that is slower than the camera: the newest image counts, and nothing is lost unsaid.
TEST(Segment, DroppedImagesAreCounted) {
  const TestDomain domain;
  const NetworkFolder network(1500, 1000);
  const auto bus = test_participant(domain);
  Colours robot(bus, "robot1");
  Process segment(segment_command(domain, network, {"--robot", "robot1"}));
  ASSERT_TRUE(eventually([&] { return robot.connected(); })) << segment.err();
  StampNs stamp_ns = kFirstStampNs;
  ASSERT_TRUE(eventually([&] {
    // Faster than any machine's network.
    for (int i = 0; i < 20; ++i) robot.send(++stamp_ns, {0, 0, 200});
    return segment.err().find("images_dropped") != std::string::npos;
  })) << segment.err();
  ASSERT_TRUE(eventually([&] { return !robot.masks().empty(); }));
  segment.signal(SIGTERM);
  const CommandResult result = segment.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(count_of(result.err, "images_dropped"), 1u) << result.err;
  const SegmentCounts counts = counts_of(result);
  EXPECT_GT(counts.dropped, 0u);
  EXPECT_LE(counts.images - counts.masks - counts.dropped, 1u)
      << result.out;  // one may wait at the end
}

TEST(Segment, TheNodeUsesTheMasks) {
  const TestDomain domain;
  const NetworkFolder network;
  const auto bus = test_participant(domain);
  FrameWatch frames(bus);
  Process node(fleet_command(domain, {"--lossless", "--set", "node.segmentation=required"}));
  Process segment(segment_command(domain, network, {"--lossless", "--robot", "robot1"}));
  Colours colours(bus, "robot1");
  RobotSender robot(bus, "robot1");
  ASSERT_TRUE(eventually([&] { return robot.matched() && colours.matched() && frames.matched(); }))
      << node.err() << segment.err();
  // Once one frame has found its mask, the segmenter has found the node: no later mask is lost.
  StampNs stamp_ns = 0;
  const auto send = [&] {
    stamp_ns += 100'000'000;
    colours.send(stamp_ns, {0, 200, 0});
    robot.send_frame(stamp_ns);
  };
  ASSERT_TRUE(eventually([&] {
    send();
    return frames.processed("robot1") > 0;
  })) << node.err();
  const StampNs first_ns = stamp_ns + 1;
  constexpr int kFrames = 10;
  for (int i = 0; i < kFrames; ++i) send();
  EXPECT_TRUE(eventually([&] { return frames.processed("robot1", first_ns) == kFrames; }))
      << node.err();
}

TEST(Segment, PlayedWithANetworkEqualsOffline) {
  const TemporaryFolder folder;
  const NetworkFolder network;
  const RunSummary expected = offline_run(scenario(), folder.path() / "offline",
                                          {"--network", network.model(), "--max-frames", "40"});
  ASSERT_GT(expected.objects, 0u);
  const RunSummary own = offline_run(scenario(), folder.path() / "own", {"--max-frames", "40"});
  ASSERT_NE(expected.map_digest, own.map_digest) << "the masks have to differ to be a test";
  const TestDomain domain;
  Process node(node_command(domain, {"--lossless"}));
  play_and_compare(domain, node,
                   play_command(domain, {"--max-frames", "40", "--network", network.model(),
                                         "--config", source("config/simulated.yaml")}),
                   expected);
}

TEST(Segment, AModelThatOpenCvCannotLoadIsRefusedByItsOperator) {
  const TestDomain domain;
  const NetworkFolder network;
  TinyOnnx onnx = TinyOnnx::convolution(30, 20, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  onnx.nodes = {TinyOnnx::convolve("image", "logits"), {"NoSuchOperator", {"logits"}, "the_end"}};
  onnx.write(network.model());
  for (const CommandResult& result :
       {run_command(segment_command(domain, network)),
        run_command({bin("pocd_map"), "--dataset", "sim", "--input", scenario(), "--config",
                     source("config/simulated.yaml"), "--network", network.model(), "--output",
                     (network.path() / "out").string()})}) {
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find(network.model() + ": OpenCV cannot load the network"),
              std::string::npos)
        << result.err;
    EXPECT_NE(result.err.find("NoSuchOperator"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("the_end"), std::string::npos) << result.err;
  }
}

}  // namespace
}  // namespace pocd

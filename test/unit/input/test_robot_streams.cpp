// RobotStreams: what robots really send becomes frames, or is named.
#include "pocd/input/robot_streams.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

namespace pocd {
namespace {

using Stream = RobotStreams::Stream;
constexpr StampNs kMs = 1'000'000;
constexpr StampNs kStart = 1'700'000'000'000 * kMs;  // a wall clock

ClassMap classes() {
  ClassMap map;
  map.list = {{1, "floor", ClassRole::kGround, 1, ""}, {7, "box", ClassRole::kObject, 0, ""}};
  map.default_class = 5;
  return map;
}

/// A robot of 10 Hz whose messages a test can change.
class RobotStreamsTest : public ::testing::Test {
 protected:
  RobotStreamsTest() {
    input_.segmentation = StreamUse::kOptional;
    robot_.name = "r";
  }

  RobotStreams& streams() {
    if (!streams_) {
      const StreamContext context{input_, labels_, 3.0, shared_, problems_};
      streams_ = std::make_unique<RobotStreams>(robot_, context);
    }
    return *streams_;
  }
  static ImageView view(const cv::Mat& image, const char* encoding) {
    ImageView v;
    v.width = static_cast<std::uint32_t>(image.cols);
    v.height = static_cast<std::uint32_t>(image.rows);
    v.encoding = encoding;
    v.step = static_cast<std::uint32_t>(image.step);
    v.data = image.data;
    v.size = image.step * static_cast<std::size_t>(image.rows);
    return v;
  }
  void depth(StampNs stamp_ns, const std::string& frame = "camera", int value = 1500) {
    const cv::Mat image(6, 8, CV_16UC1, cv::Scalar(value));
    streams().add_image(Stream::kDepth, stamp_ns, frame, view(image, "16UC1"));
  }
  void mask(StampNs stamp_ns, int id = 7, int cols = 8, int rows = 6) {
    const cv::Mat image(rows, cols, CV_8UC1, cv::Scalar(id));
    streams().add_image(Stream::kSegmentation, stamp_ns, "camera", view(image, "mono8"));
  }
  void info(StampNs stamp_ns) {
    streams().add_camera_info(stamp_ns, CameraModel{8, 6, 5, 5, 3.5, 2.5});
  }
  void odometry(StampNs stamp_ns, const std::string& parent = "map",
                const std::string& child = "camera", double norm = 1.0) {
    StampedTransform T{parent, child, stamp_ns, {}};
    T.T.rotation.coeffs() *= norm;
    streams().add_odometry(checked_transform(T));
  }
  std::vector<Frame> collect(bool last = false) {
    for (Frame& frame : streams().take(last)) frames_.push_back(std::move(frame));
    return frames_;
  }
  /// `count` times at 10 Hz, frames being taken after each.
  void run(int count, const std::function<void(StampNs)>& send) {
    for (int i = 0; i < count; ++i) {
      send(kStart + i * 100 * kMs);
      collect();
    }
    collect(true);
  }
  std::uint64_t problem(InputReason reason) const {
    std::uint64_t count = 0;
    for (const auto& entry : problems_.entries()) {
      if (entry.reason == to_string(reason)) count += entry.count;
    }
    return count;
  }
  std::string detail(InputReason reason) const {
    for (const auto& entry : problems_.entries()) {
      if (entry.reason == to_string(reason)) return entry.detail;
    }
    return "";
  }
  int with_labels(int id = 7) const {
    return static_cast<int>(std::count_if(frames_.begin(), frames_.end(), [&](const Frame& frame) {
      return !frame.labels.empty() && frame.labels.at<std::uint16_t>(3, 3) == id;
    }));
  }

  InputConfig input_;
  RobotConfig robot_;
  LabelTable labels_{classes()};
  TransformTree shared_{500 * kMs};
  ProblemCounter problems_{nullptr};
  std::unique_ptr<RobotStreams> streams_;
  std::vector<Frame> frames_;
};

TEST_F(RobotStreamsTest, WholeFramesGiveNoProblem) {
  run(20, [&](StampNs t) { odometry(t), info(t), depth(t), mask(t); });
  EXPECT_EQ(frames_.size(), 20u);
  EXPECT_EQ(with_labels(), 20);
  EXPECT_EQ(problems_.total(), 0u);
}

// A network that stamps its masks a little off: each frame gets its own, the nearest one, whether
// earlier or later.
TEST_F(RobotStreamsTest, MasksWithinTheToleranceAreTheFramesOwn) {
  for (const StampNs off : {-9 * kMs, -3 * kMs, 3 * kMs, 10 * kMs}) {
    streams_.reset();
    frames_.clear();
    int i = 0;
    run(20, [&](StampNs t) { odometry(t), info(t), depth(t), mask(t + off, 7 + i++); });
    ASSERT_EQ(frames_.size(), 20u) << off;
    for (int k = 0; k < 20; ++k) {
      EXPECT_EQ(frames_[static_cast<std::size_t>(k)].labels.at<std::uint16_t>(0, 0), 7 + k) << off;
    }
    EXPECT_EQ(problem(InputReason::kNoMask), 0u) << off;
  }
}

TEST_F(RobotStreamsTest, MasksBeyondTheToleranceAreNamedWithTheGap) {
  run(20, [&](StampNs t) { odometry(t), info(t), depth(t), mask(t + 43 * kMs); });
  EXPECT_EQ(frames_.size(), 20u);
  EXPECT_EQ(with_labels(), 0);
  EXPECT_EQ(problem(InputReason::kNoMask), 20u);
  EXPECT_NE(detail(InputReason::kNoMask).find("43.0 ms later"), std::string::npos)
      << detail(InputReason::kNoMask);
  EXPECT_NE(detail(InputReason::kNoMask).find("goes on without mask"), std::string::npos);
}

TEST_F(RobotStreamsTest, ARobotWithoutMasksIsNoProblem) {
  run(20, [&](StampNs t) { odometry(t), info(t), depth(t); });
  EXPECT_EQ(frames_.size(), 20u);
  EXPECT_EQ(problems_.total(), 0u);
}

TEST_F(RobotStreamsTest, IdsThatAreNoClassAreNamedWithTheirShare) {
  run(10, [&](StampNs t) {
    odometry(t), info(t), depth(t);
    cv::Mat image(6, 8, CV_8UC1, cv::Scalar(1));
    image.rowRange(0, 3).setTo(200);
    streams().add_image(Stream::kSegmentation, t, "camera", view(image, "mono8"));
  });
  EXPECT_EQ(frames_.size(), 10u);
  EXPECT_EQ(problem(InputReason::kUnlistedClass), 10u);
  const std::string said = detail(InputReason::kUnlistedClass);
  EXPECT_NE(said.find("200"), std::string::npos) << said;
  EXPECT_NE(said.find("50 %"), std::string::npos) << said;
}

TEST_F(RobotStreamsTest, MasksOfAnotherFrameAreNamedAndUsed) {
  const cv::Mat ids(6, 8, CV_8UC1, cv::Scalar(7));
  run(5, [&](StampNs t) {
    odometry(t), info(t), depth(t);
    streams().add_image(Stream::kSegmentation, t, "/other", view(ids, "mono8"));
  });
  EXPECT_EQ(with_labels(), 5);
  EXPECT_EQ(problem(InputReason::kOtherFrame), 5u);
  EXPECT_NE(detail(InputReason::kOtherFrame)
                .find("header.frame_id is \"other\", that of the depth images \"camera\""),
            std::string::npos);
}

TEST_F(RobotStreamsTest, MasksOfAnotherSizeAreResizedAndOfAnotherShapeRefused) {
  run(5, [&](StampNs t) { odometry(t), info(t), depth(t), mask(t, 7, 16, 12); });
  EXPECT_EQ(with_labels(), 5);
  EXPECT_EQ(problems_.total(), 0u);
  streams_.reset();
  frames_.clear();
  run(5, [&](StampNs t) { odometry(t), info(t), depth(t), mask(t, 7, 12, 12); });
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(problem(InputReason::kSizesDisagree), 5u);
  EXPECT_NE(detail(InputReason::kSizesDisagree).find("12x12"), std::string::npos);
}

// Half of the images would be mapped beside their place.
TEST_F(RobotStreamsTest, AnotherFrameOfTheDepthImagesIsRefusedByName) {
  PoseQuaternion beside;
  beside.position.y() = 1.0;
  shared_.set_static("base", "camera", {});
  shared_.set_static("base", "other", beside);
  run(20, [&](StampNs t) {
    odometry(t, "map", "base");
    info(t), depth(t, t >= kStart + 1000 * kMs ? "other" : "camera"), mask(t);
  });
  EXPECT_EQ(frames_.size(), 10u);
  EXPECT_EQ(problem(InputReason::kFrameChanged), 10u);
  EXPECT_NE(detail(InputReason::kFrameChanged).find("was \"camera\", now \"other\""),
            std::string::npos);
}

// A camera that counts from its start while poses have the wall clock, and the other way round.
TEST_F(RobotStreamsTest, ClocksThatDisagreeAreNamedWithBothTimes) {
  for (const bool camera_from_boot : {true, false}) {
    streams_.reset();
    frames_.clear();
    run(20, [&](StampNs t) {
      const StampNs boot = t - kStart + 12'000 * kMs;
      odometry(camera_from_boot ? t : boot);
      const StampNs image = camera_from_boot ? boot : t;
      info(image), depth(image), mask(image);
    });
    EXPECT_TRUE(frames_.empty());
  }
  EXPECT_EQ(problem(InputReason::kNoPose), 40u);
  const std::string said = detail(InputReason::kNoPose);
  EXPECT_NE(said.find("1700000000.000 s"), std::string::npos) << said;
  EXPECT_NE(said.find("12.000 s"), std::string::npos) << said;
  EXPECT_NE(said.find("different clocks"), std::string::npos) << said;
}

TEST_F(RobotStreamsTest, CameraInfoOnceOrWithoutStampIsEnough) {
  for (const StampNs stamp_ns : {StampNs{0}, kStart, kStart + 400 * kMs}) {
    for (const bool patient : {true, false}) {
      streams_.reset();
      frames_.clear();
      streams().synchronizer().set_patience(patient ? Patience::kEndless : Patience::kBounded);
      int i = 0;
      run(100, [&](StampNs t) {
        odometry(t), depth(t), mask(t);
        if (i++ == 0) info(stamp_ns);
      });
      EXPECT_EQ(frames_.size(), 100u) << stamp_ns << patient;
    }
  }
  streams_.reset();
  frames_.clear();
  run(20, [&](StampNs t) { odometry(t), info(0), depth(t), mask(t); });
  EXPECT_EQ(frames_.size(), 20u);
  EXPECT_EQ(problems_.total(), 0u) << "stamp 0 again and again is no stamp that goes back";
}

TEST_F(RobotStreamsTest, SlashesInFrontOfFramesAreLeftOutAsTf2Does) {
  input_.map_frame = "/map";
  run(5, [&](StampNs t) { odometry(t, "/map", "camera"), info(t), depth(t, "/camera"), mask(t); });
  EXPECT_EQ(frames_.size(), 5u);
  EXPECT_EQ(problems_.total(), 0u);
}

// tf2 takes a quaternion whose square is off by up to 0.01.
TEST_F(RobotStreamsTest, QuaternionsAreAsTf2TakesThem) {
  run(5, [&](StampNs t) { odometry(t, "map", "camera", 1.0016), info(t), depth(t), mask(t); });
  ASSERT_EQ(frames_.size(), 5u);
  // Normalised in double precision.
  EXPECT_TRUE(frames_[0].T_W_C.linear().isIdentity(1e-12));
  streams_.reset();
  frames_.clear();
  run(5, [&](StampNs t) { odometry(t, "map", "camera", 1.01), info(t), depth(t), mask(t); });
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(problem(InputReason::kNonUnitQuaternion), 5u);
}

TEST_F(RobotStreamsTest, AnotherUnitOfDepthIsHintedAtAndCanBeSet) {
  run(10, [&](StampNs t) { odometry(t), info(t), depth(t, "camera", 15000), mask(t); });
  EXPECT_EQ(frames_.size(), 10u);
  EXPECT_GT(problem(InputReason::kNoUsableDepth), 0u);
  const std::string said = detail(InputReason::kNoUsableDepth);
  EXPECT_NE(said.find("median depth is 15 m"), std::string::npos) << said;
  EXPECT_NE(said.find("depth_scale"), std::string::npos) << said;
  for (const bool of_robot : {false, true}) {
    streams_.reset();
    frames_.clear();
    problems_ = ProblemCounter(nullptr);
    (of_robot ? robot_.depth_scale : input_.depth_scale) = 0.1;
    if (of_robot) input_.depth_scale = 50;
    run(10, [&](StampNs t) { odometry(t), info(t), depth(t, "camera", 15000), mask(t); });
    ASSERT_EQ(frames_.size(), 10u);
    EXPECT_FLOAT_EQ(frames_[0].depth_m.at<float>(0, 0), 1.5f);
    EXPECT_EQ(problems_.total(), 0u);
  }
}

TEST_F(RobotStreamsTest, AMissingTransformIsNamedEvenWhenTheRunEndsSoon) {
  run(5, [&](StampNs t) { odometry(t, "map", "base"), info(t), depth(t), mask(t); });
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(problem(InputReason::kNoTransform), 5u);
  EXPECT_NE(detail(InputReason::kNoTransform).find("nobody says where \"camera\" is"),
            std::string::npos);
}

TEST_F(RobotStreamsTest, KeepsARateInTheMean) {
  input_.max_frame_rate_hz = 4;
  run(100, [&](StampNs t) { odometry(t), info(t), depth(t), mask(t); });
  // 10 Hz for 9.9 s at 4 Hz.
  EXPECT_EQ(frames_.size(), 40u);
  EXPECT_EQ(streams().rate_limited(), 60u);
  EXPECT_EQ(streams().losses(), "r: frames left out: 60 beyond node.max_frame_rate_hz");
}

// What a robot says of its own frames on two topics does not interleave.
TEST_F(RobotStreamsTest, OdometryGoesBeforeTransformsOfItsOwn) {
  robot_.tf_topic = "rt/r/tf";
  robot_.tf_static_topic = "rt/r/tf_static";
  run(20, [&](StampNs t) {
    odometry(t);
    add_transform(checked_transform({"map", "camera", t - 7 * kMs, {}}), false, "rt/r/tf",
                  streams().own_transforms(), problems_);
    info(t), depth(t), mask(t);
  });
  EXPECT_EQ(frames_.size(), 20u);
  EXPECT_EQ(problems_.total(), 0u);
}

}  // namespace
}  // namespace pocd

// Several robots look at the same objects: nothing counts twice, and it is known who saw what.
#include <gtest/gtest.h>

#include <map>

#include "drive.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::room_with;
using test::solid;

const SceneObject kBox = solid(kBoxClass, {-0.3, 2.3}, {0.6, 0.4, 0.6});

/// Looks from the same place at the same time by these robots, who see `scene`; the second one with
/// noise of its own.
class Crowd {
 public:
  explicit Crowd(std::vector<std::string> robots, int blind_columns_of_first = 0)
      : robots_(std::move(robots)), blind_columns_(blind_columns_of_first) {}

  void watch(const Scene& scene, int moments) {
    for (int i = 0; i < moments; ++i) look(scene);
  }
  /// Moments until the box is reported as gone, or -1.
  int moments_until_removed(const Scene& scene, int most) {
    for (int i = 1; i <= most; ++i) {
      look(scene);
      for (const ObjectEvent& event : events) {
        if (event.kind == EventKind::kRemoved) return i;
      }
    }
    return -1;
  }
  std::vector<ObjectSnapshot> objects() const { return pipeline_.objects(); }

  std::vector<ObjectEvent> events;

 private:
  void look(const Scene& scene) {
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      Frame frame = test::shoot(scene, test::swaying_camera(count_), count_);
      test::add_noise(frame, config_.depth_noise, 3 + r);
      frame.robot = robots_[r];
      frame.stamp_ns += static_cast<StampNs>(r) * 30'000'000;  // less than a moment
      if (r == 0 && blind_columns_ > 0) frame.depth_m.colRange(0, blind_columns_).setTo(0.0f);
      const FrameResult result = pipeline_.process_frame(frame);
      EXPECT_TRUE(result.accepted);
      events.insert(events.end(), result.events.begin(), result.events.end());
    }
    ++count_;
  }

  std::vector<std::string> robots_;
  int blind_columns_;
  PipelineConfig config_ = test::room_config();
  PocdPipeline pipeline_{config_};
  std::uint64_t count_ = 0;
};

// Five moments seen by one robot and by three.
TEST(TwoRobots, ALookFromTheSameMomentDoesNotCountAgain) {
  Crowd one({"a"}), three({"a", "b", "c"});
  for (Crowd* crowd : {&one, &three}) crowd->watch(room_with({kBox}), 5);
  ASSERT_EQ(one.objects().size(), 1u);
  ASSERT_EQ(three.objects().size(), 1u);
  const ObjectSnapshot alone = one.objects()[0], together = three.objects()[0];
  EXPECT_EQ(together.observations, alone.observations);
  // The measured change is of millimetres, so E[v] hardly depends on which of the views counts; if
  // all three counted, it would be as after fifteen moments.
  Crowd longer({"a"});
  longer.watch(room_with({kBox}), 15);
  const double apart = longer.objects()[0].belief.stationarity() - alone.belief.stationarity();
  ASSERT_GT(apart, 0.01);
  EXPECT_NEAR(together.belief.stationarity(), alone.belief.stationarity(), 0.1 * apart);
}

TEST(TwoRobots, ARemovalTakesAsManyMomentsAsForOneRobot) {
  int moments[2];
  for (int robots = 1; robots <= 2; ++robots) {
    Crowd crowd(robots == 1 ? std::vector<std::string>{"a"} : std::vector<std::string>{"a", "b"});
    crowd.watch(room_with({kBox}), 20);
    moments[robots - 1] = crowd.moments_until_removed(room_with({}), 40);
  }
  ASSERT_GT(moments[0], 1);
  // One moment of noise: who sees more of the place decides which of two equal looks counts.
  EXPECT_NEAR(moments[1], moments[0], 1);
}

// The first robot sees the left edge of the box only; the second one, all of it.
TEST(TwoRobots, TheLookThatSawMoreCounts) {
  Crowd crowd({"a", "b"}, 150);
  crowd.watch(room_with({kBox}), 20);
  Crowd best({"b"});
  best.watch(room_with({kBox}), 20);
  ASSERT_EQ(crowd.objects().size(), 1u);
  ASSERT_EQ(best.objects().size(), 1u);
  const double expected = best.objects()[0].belief.stationarity();
  EXPECT_NEAR(crowd.objects()[0].belief.stationarity(), expected, 0.02);
  const int moments = crowd.moments_until_removed(room_with({}), 40);
  EXPECT_GT(moments, 1);
}

TEST(TwoRobots, WhoSawItIsKnown) {
  Crowd crowd({"robot_b", "robot_a"});
  crowd.watch(room_with({kBox}), 8);
  ASSERT_EQ(crowd.objects().size(), 1u);
  EXPECT_EQ(crowd.objects()[0].seen_by, (std::vector<std::string>{"robot_a", "robot_b"}));
  EXPECT_EQ(crowd.objects()[0].last_robot, "robot_a");
  ASSERT_FALSE(crowd.events.empty());
  EXPECT_EQ(crowd.events[0].kind, EventKind::kAdded);
  EXPECT_FALSE(crowd.events[0].robot.empty());
}

/// A robot in the room, and one in a room like it a storey higher.
class TwoStoreys : public ::testing::Test {
 protected:
  static constexpr double kStorey_m = 1.5;
  FrameResult look(const std::string& robot, const Scene& scene, bool floor_in_view = true) {
    const bool up = robot == "up";
    Scene there = scene;
    const Eigen::Vector3d off(up ? 30.0 : 0.0, 0.0, up ? kStorey_m : 0.0);
    for (SceneObject& object : there.objects) object.T_W_O.pretranslate(off);
    Pose eye = test::swaying_camera(count_);
    eye.pretranslate(off);
    Frame frame = test::shoot(there, eye, count_);
    test::add_noise(frame, DepthNoise(), 7);
    if (!floor_in_view) frame.depth_m.setTo(0.0f, frame.labels == test::kFloorClass);
    frame.robot = robot;
    frame.stamp_ns += up ? 30'000'000 : 0;
    return pipeline_.process_frame(frame);
  }
  void look_both(const Scene& scene, int times) {
    for (int i = 0; i < times; ++i, ++count_) look("down", scene), look("up", scene);
  }

  PocdPipeline pipeline_{test::room_config()};
  std::uint64_t count_ = 0;
};

TEST_F(TwoStoreys, EachRobotHasAGroundOfItsOwn) {
  look_both(room_with({kBox}), 10);
  ASSERT_EQ(pipeline_.objects().size(), 2u);
  for (const ObjectSnapshot& o : pipeline_.objects()) {
    const double floor_m = o.box.pose.position_W.x() > 15.0 ? kStorey_m : 0.0;
    EXPECT_NEAR(o.box.pose.position_W.z() - 0.5 * o.box.size_m.z(), floor_m, 0.05);
  }
  // Without the floor in view each goes by what it knows of its own: by the upper one's all that
  // the lower one sees would be ground.
  const SceneObject another = solid(kBoxClass, {0.7, 2.0}, {0.4, 0.4, 0.6});
  for (int i = 0; i < 15; ++i, ++count_) {
    look("up", room_with({kBox}));
    look("down", room_with({kBox, another}), false);
  }
  EXPECT_EQ(pipeline_.objects().size(), 3u);
}

// A robot, or who plays one, with a new name again and again: what the pipeline keeps of each is
// measured by what a memory would store.
TEST(ManyNames, TheRobotHeardOfLongestAgoIsForgottenByName) {
  PocdPipeline pipeline(test::room_config());
  Frame frame = test::shoot(room_with({}), test::swaying_camera(0));
  frame.camera = {32, 24, 26.0, 26.0, 15.5, 11.5};
  frame.depth_m = frame.depth_m(cv::Rect(144, 108, 32, 24)).clone();
  frame.labels = frame.labels(cv::Rect(144, 108, 32, 24)).clone();
  const auto show = [&](int name) {
    frame.robot = "name" + std::to_string(name);
    frame.stamp_ns += 66'666'667;
    return pipeline.process_frame(frame);
  };
  std::map<std::uint64_t, std::size_t> part_bytes;
  const auto bytes = [&] {
    std::size_t sum = 0;
    for (const Piece& piece : pipeline.take_changed_pieces()) {
      if (piece.kind == PieceKind::kPart) part_bytes[piece.key] = piece.bytes.size();
    }
    for (const auto& [part, size] : part_bytes) sum += size;
    return sum;
  };
  const int most = static_cast<int>(PoseGate::kMostRobots);
  for (int i = 0; i < most; ++i) ASSERT_TRUE(show(1000 + i).warnings.empty()) << i;
  const std::size_t full = bytes();
  ASSERT_TRUE(show(1000).warnings.empty()) << "it is known";
  for (int i = 0; i < 50; ++i) {
    const FrameResult result = show(1000 + most + i);
    ASSERT_EQ(result.warnings.size(), 1u);
    EXPECT_NE(result.warnings[0].find("name" + std::to_string(1001 + i) + ", heard of longest ago"),
              std::string::npos)
        << result.warnings[0];
  }
  // A new robot has no speed yet, and the one that came twice has one.
  EXPECT_LT(bytes(), full + 100);
}

}  // namespace
}  // namespace pocd

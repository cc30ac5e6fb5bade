#include "pocd/sim/sim_reader.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <opencv2/core.hpp>

#include "pocd/common/check.hpp"
#include "pocd/sim/scenario_yaml.hpp"

namespace pocd {
namespace {

Scenario demo() {
  return load_scenario(std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/demo.yaml");
}

bool same_frame(const Frame& a, const Frame& b) {
  const auto same = [](const cv::Mat& x, const cv::Mat& y) {
    return x.type() == y.type() && x.size() == y.size() &&
           std::memcmp(x.data, y.data, x.total() * x.elemSize()) == 0;
  };
  return a.stamp_ns == b.stamp_ns && a.sequence == b.sequence && a.robot == b.robot &&
         a.T_W_C.matrix() == b.T_W_C.matrix() && same(a.depth_m, b.depth_m) &&
         same(a.labels, b.labels) && same(a.color, b.color);
}

TEST(SimReader, FrameDependsOnSeedAndNumberOnly) {
  SimReaderOptions options;
  options.seed = 4;
  SimReader first(demo(), options);
  options.threads = 2;
  SimReader second(demo(), options);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(first.next().has_value());
  const auto walked = first.next();
  ASSERT_TRUE(walked.has_value());
  EXPECT_TRUE(same_frame(*walked, second.frame(3)));
  EXPECT_FALSE(same_frame(first.frame(2), second.frame(3)));
  options.seed = 5;
  EXPECT_FALSE(same_frame(*walked, SimReader(demo(), options).frame(3)));
}

TEST(SimReader, RobotsTakeTurnsAndStampsGoOn) {
  const SimReader reader(demo(), {});
  const auto& frames = reader.schedule().frames();
  std::map<std::size_t, std::size_t> sequence;
  std::size_t visits = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].robot_sequence, sequence[frames[i].robot]++);
    visits = std::max(visits, frames[i].visit + 1);
    if (i == 0) continue;
    EXPECT_LT(frames[i - 1].stamp_ns, frames[i].stamp_ns);
    EXPECT_LE(frames[i - 1].visit, frames[i].visit);
    if (frames[i].visit == frames[i - 1].visit) {
      EXPECT_NE(frames[i].robot, frames[i - 1].robot);
    }
  }
  EXPECT_EQ(visits, 3u);
  EXPECT_EQ(sequence.size(), 2u);
  EXPECT_EQ(reader.frame(0).robot, "robot1");
  EXPECT_EQ(reader.frame(1).robot, "robot2");
  // A lap of the demonstration lasts at most 15 s.
  EXPECT_LE(frames.size(), 3u * 2u * 15u * 15u);
}

TEST(SimReader, PerfectSensorGivesTheTruth) {
  Scenario scenario = demo();
  scenario.sensor = SensorModel::perfect();
  const SimReader reader(scenario, {});
  EXPECT_TRUE(same_frame(reader.frame(40), reader.true_frame(40)));
  const SimReader noisy(demo(), {});
  EXPECT_FALSE(same_frame(noisy.frame(40), noisy.true_frame(40)));
  EXPECT_TRUE(same_frame(noisy.true_frame(40), reader.true_frame(40)));
}

TEST(SimReader, LabelsCarryInstances) {
  Scenario scenario = demo();
  scenario.sensor = SensorModel::perfect();
  SimReaderOptions options;
  options.label_divisor = 100;
  const SimReader reader(scenario, options), plain(scenario, {});
  std::map<int, int> pixels;
  for (std::size_t i = 0; i < 200; i += 7) {
    const cv::Mat with = reader.frame(i).labels, without = plain.frame(i).labels;
    for (int v = 0; v < with.rows; ++v) {
      for (int u = 0; u < with.cols; ++u) {
        ASSERT_EQ(with.at<std::uint16_t>(v, u) / 100, without.at<std::uint16_t>(v, u));
        ++pixels[with.at<std::uint16_t>(v, u)];
      }
    }
  }
  int instances_of_goods = 0;
  for (const auto& [code, count] : pixels) instances_of_goods += code / 100 == 7;
  EXPECT_EQ(instances_of_goods, 6);
}

TEST(SimReader, RefusesScenariosThatCannotBe) {
  Scenario scenario = demo();
  scenario.visits.clear();
  EXPECT_THROW(SimReader(scenario, {}), InputError);
}

}  // namespace
}  // namespace pocd

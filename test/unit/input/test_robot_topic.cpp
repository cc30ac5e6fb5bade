// Which robot a topic belongs to.
#include <gtest/gtest.h>

#include "pocd/input/robot_topic.hpp"

namespace pocd {
namespace {

TEST(RobotTopic, FindsTheNameThatWasPutIn) {
  for (const char* pattern :
       {"rt/{robot}/depth/image_raw", "{robot}/depth", "rt/depth/{robot}", "rt/cam_{robot}_depth",
        "rt/{robot}/{robot}_camera/depth", "{robot}"}) {
    for (const char* name : {"robot1", "a", "depth", "r_2_depth"}) {
      EXPECT_EQ(robot_in(pattern, robot_topic(pattern, name)), name) << pattern;
    }
  }
}

TEST(RobotTopic, RefusesWhatDoesNotFit) {
  const std::string pattern = "rt/{robot}/depth";
  for (const char* topic : {"", "rt", "rt/", "rt//depth", "rt/a/b/depth", "rt/a/depth/image",
                            "rt/a/color", "xrt/a/depth", "rt/a/dept"}) {
    EXPECT_FALSE(robot_in(pattern, topic)) << topic;
  }
  EXPECT_FALSE(robot_in("rt/{robot}/{robot}/depth", "rt/a/b/depth"));
  EXPECT_EQ(robot_in("rt/depth", "rt/depth"), "");
  EXPECT_FALSE(robot_in("rt/depth", "rt/depths"));
}

}  // namespace
}  // namespace pocd

// Every parameter that is a word, of the pipeline and the node.
#include <gtest/gtest.h>

#include "every_choice.hpp"
#include "pocd/config/node_config.hpp"

namespace pocd {
namespace {

TEST(Choices, OfAConfigurationFileAreChecked) {
  EXPECT_EQ(
      test::try_every_choice<NodeFile>(),
      (std::vector<std::string>{"classes.without_masks", "classes.list[0].role", "map.memory.limit",
                                "node.segmentation", "node.color", "node.outputs.ros_release"}));
}

}  // namespace
}  // namespace pocd

// A configuration made in C++ is checked before anything is made of it.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "pocd/common/check.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace pocd {
namespace {

std::string refusal(const std::function<void(PipelineConfig&)>& change) {
  PipelineConfig config;
  change(config);
  try {
    const PocdPipeline pipeline(config);
  } catch (const InputError& error) {
    return error.what();
  }
  return "taken";
}

TEST(PipelineConfigFromCpp, IsCheckedFieldByField) {
  EXPECT_EQ(refusal([](PipelineConfig&) {}), "taken");
  // A stride of 0 divides by it.
  EXPECT_NE(refusal([](PipelineConfig& c) {
              c.segmentation.stride = 0;
            }).find("segmentation.stride: 0 is out of range, allowed are 1 to "),
            std::string::npos);
  EXPECT_NE(refusal([](PipelineConfig& c) {
              c.change.tau_m = std::nan("");
            }).find("change.tau_m: nan is out of range"),
            std::string::npos);
  EXPECT_NE(refusal([](PipelineConfig& c) {
              c.map.voxel_size_m = -0.05;
            }).find("map.voxel_size_m: -0.05 is out of range"),
            std::string::npos);
}

// A number that is no value of an enum would be taken for one.
TEST(PipelineConfigFromCpp, ChoicesAreOnesThatThereAre) {
  EXPECT_NE(refusal([](PipelineConfig& c) {
              c.classes.without_masks = static_cast<WithoutMasks>(2);
            }).find("classes.without_masks: \"2\" is not one of: things, default_class"),
            std::string::npos);
  EXPECT_NE(refusal([](PipelineConfig& c) {
              c.classes.list = {{4, "box", static_cast<ClassRole>(5), 0}};
            }).find("classes.list[0].role: \"5\" is not one of: "),
            std::string::npos);
}

TEST(PipelineConfigFromCpp, RulesBetweenFieldsHold) {
  EXPECT_NE(
      refusal([](PipelineConfig& c) {
        c.classes.list = {{4, "box", ClassRole::kObject, 0}, {4, "bin", ClassRole::kObject, 0}};
      }).find("classes: list[1].id: 4 is that of list[0]"),
      std::string::npos);
}

}  // namespace
}  // namespace pocd

#include "pocd/sim/open_source.hpp"

#include <gtest/gtest.h>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

std::string error_of(const DatasetOptions& options) {
  try {
    open_source(options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(OpenSource, SimulatorTakesScenariosInOrder) {
  const std::filesystem::path scenarios =
      std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/torwic";
  DatasetOptions options;
  options.format = "sim";
  options.inputs = {scenarios / "0.yaml"};
  const std::size_t one = open_source(options)->size();
  options.inputs.push_back(scenarios / "2-1.yaml");
  options.sensor = "perfect";
  const auto both = open_source(options);
  EXPECT_EQ(both->size(), 2 * one);
  EXPECT_EQ(both->extrinsics().camera_frame, "realsense_front_camera_color_optical_frame");
  ASSERT_TRUE(both->next().has_value());
  options.sensor = "lidar";
  EXPECT_NE(error_of(options).find("lidar"), std::string::npos);
  options.inputs = {"/nowhere/at_all.yaml"};
  EXPECT_NE(error_of(options).find("/nowhere/at_all"), std::string::npos);
  options.format = "torwic";
  EXPECT_NE(error_of(options).find("/nowhere/at_all"), std::string::npos) << "as open_dataset";
}

}  // namespace
}  // namespace pocd

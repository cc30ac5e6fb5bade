// Every file in config/ loads, and the published data sets' files hold the published values.
#include <gtest/gtest.h>

#include <algorithm>

#include "config_fixture.hpp"

namespace pocd {
namespace {

const std::filesystem::path kFolder = std::filesystem::path(POCD_SOURCE_DIR) / "config";

PipelineConfig load_shipped(const std::string& name) {
  PipelineConfig config;
  load_config(config, {kFolder / name});
  return config;
}

std::vector<std::string> shipped_files() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

class ShippedConfig : public testing::TestWithParam<std::string> {};

TEST_P(ShippedConfig, LoadsAndSurvivesADump) {
  const PipelineConfig config = load_shipped(GetParam());
  const std::string text = dump_config(config);
  const TemporaryFile file(text);
  PipelineConfig again;
  load_config(again, {file.path()});
  EXPECT_EQ(dump_config(again), text);
}

TEST_P(ShippedConfig, HasAnObjectClassIfItListsClasses) {
  const ClassMap classes = load_shipped(GetParam()).classes;
  if (classes.list.empty()) GTEST_SKIP() << "an overlay without classes";
  EXPECT_TRUE(std::any_of(classes.list.begin(), classes.list.end(),
                          [](const ClassInfo& c) { return c.role == ClassRole::kObject; }));
}

INSTANTIATE_TEST_SUITE_P(Files, ShippedConfig, testing::ValuesIn(shipped_files()),
                         [](const auto& info) {
                           return std::filesystem::path(info.param).stem().string();
                         });

TEST(ShippedConfigs, TorwicHasThePublishedParameters) {
  const PipelineConfig c = load_shipped("torwic.yaml");
  EXPECT_EQ(c.map.voxel_size_m, 0.05);
  EXPECT_EQ(c.map.max_depth_m, 3.0);
  EXPECT_EQ(c.association.max_distance_m, 0.9);
  EXPECT_EQ(c.association.max_dissimilarity, 0.10);
  EXPECT_EQ(c.association.min_visible_share, 0.10);
  EXPECT_EQ(c.change.delta_max_m, 4.0);
  EXPECT_EQ(c.change.tau_m, 0.20);
  EXPECT_EQ(c.state.remove_below, 0.4);
}

TEST(ShippedConfigs, ToycarHasThePublishedParameters) {
  const PipelineConfig c = load_shipped("toycar.yaml");
  EXPECT_EQ(c.map.voxel_size_m, 0.02);
  EXPECT_EQ(c.map.max_depth_m, 4.0);
  EXPECT_EQ(c.change.delta_max_m, 0.6);
  EXPECT_EQ(c.change.tau_m, 0.03);
  EXPECT_EQ(c.state.remove_below, 0.45);
}

TEST(ShippedConfigs, TorwicClassesHaveTheirColoursAndRoles) {
  const ClassMap classes = load_shipped("torwic.yaml").classes;
  ASSERT_EQ(classes.list.size(), 16u);
  for (std::size_t i = 0; i < classes.list.size(); ++i) {
    EXPECT_EQ(classes.list[i].id, static_cast<int>(i));
    EXPECT_TRUE(parse_rgb(classes.list[i].rgb)) << i;
  }
  EXPECT_EQ(classes.list[7].rgb, "0,153,153");
  EXPECT_EQ(classes.role(1), ClassRole::kGround);
  EXPECT_EQ(classes.role(3), ClassRole::kIgnore);
  EXPECT_EQ(classes.role(7), ClassRole::kObject);
  EXPECT_EQ(classes.stationarity_class(7), 0);
  for (const ClassId fence : {ClassId{4}, ClassId{5}}) {
    EXPECT_EQ(classes.role(fence), ClassRole::kObject);
    EXPECT_EQ(classes.stationarity_class(fence), 1);
  }
  for (const ClassId moving : {ClassId{13}, ClassId{14}, ClassId{15}}) {
    EXPECT_EQ(classes.role(moving), ClassRole::kDynamic);
  }
}

}  // namespace
}  // namespace pocd

#include <gtest/gtest.h>

#include "run_command.hpp"

namespace pocd {
namespace {

const std::string kCommand = std::string(POCD_BIN_DIR) + "/pocd_parameters";
const std::filesystem::path kRoot = POCD_SOURCE_DIR;

TEST(PocdParameters, CommittedPageIsCurrent) {
  const CommandResult result = run_command({kCommand});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(result.out == read_text(kRoot / "docs/parameters.md"))
      << "renew it with: pocd_parameters > docs/parameters.md";
}

TEST(PocdParameters, CommittedPageOfTheNodeIsCurrent) {
  const std::string command = std::string(POCD_BIN_DIR) + "/pocd_node";
  if (!std::filesystem::exists(command)) GTEST_SKIP() << "built without pocd_dds";
  const CommandResult result = run_command({command, "--parameters"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(result.out == read_text(kRoot / "docs/node_parameters.md"))
      << "renew it with: pocd_node --parameters > docs/node_parameters.md";
}

TEST(PocdParameters, PrintsEffectiveValues) {
  const CommandResult result = run_command(
      {kCommand, "--config", (kRoot / "config/toycar.yaml").string(), "--set", "map.max_weight=7"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("voxel_size_m: 0.02\n"), std::string::npos);
  EXPECT_NE(result.out.find("max_weight: 7\n"), std::string::npos);
}

TEST(PocdParameters, BadOverrideIsAUsageError) {
  const CommandResult result = run_command({kCommand, "--set", "map.max_weight=0"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err,
            "pocd_parameters: --set map.max_weight=0: map.max_weight: 0 is out of range, allowed "
            "are 1 to 1000 observations\n");
}

}  // namespace
}  // namespace pocd

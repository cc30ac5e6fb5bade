// The pipeline on real recordings whose truth is known. Skipped, saying so, where they are not
// there.
#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>

#include "pocd/config/config_io.hpp"
#include "pocd/datasets/open_dataset.hpp"
#include "pocd/eval/state_check.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace pocd {
namespace {

const std::filesystem::path kData = POCD_TEST_DATA;
const std::filesystem::path kSource = POCD_SOURCE_DIR;

TEST(Recordings, TableTopHoldsExactlyWhatIsThereAfterEachState) {
  const std::filesystem::path folder = kData / "tabletop_states";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  StateTruth truth;
  load_config(truth, {kSource / "test/data/tabletop_truth.yaml"});
  PipelineConfig config;
  load_config(config, {kSource / "config/tabletop.yaml"});
  const StateRun run = run_states(truth, folder, config, [](const StateRun& so_far) {
    if (!so_far.verdicts.back().ok_listed) std::cout << describe_last_state(so_far);
  });
  ASSERT_EQ(run.verdicts.size(), 11u);
  int right = 0;
  for (const StateVerdict& verdict : run.verdicts) right += verdict.ok_listed;
  EXPECT_EQ(right, 11);
}

TEST(Recordings, NothingIsRemovedOrMovedInAStillKitchen) {
  const std::filesystem::path folder = kData / "redkitchen";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  PipelineConfig config;
  load_config(config, {kSource / "config/redkitchen.yaml"});
  DatasetOptions options;
  options.format = DatasetFormat::kRgbd;
  options.inputs = {folder};
  options.gravity_W = Eigen::Vector3d(-0.00887, 0.90443, 0.42654).normalized();
  const auto reader = open_dataset(options);
  PocdPipeline pipeline(config);
  int frames = 0, added = 0;
  while (const auto frame = reader->next()) {
    ++frames;
    for (const ObjectEvent& event : pipeline.process_frame(*frame).events) {
      added += event.kind == EventKind::kAdded;
      EXPECT_TRUE(event.kind == EventKind::kAdded || event.kind == EventKind::kUpdated)
          << "frame " << event.frame_sequence << ": " << to_string(event.kind) << " object "
          << to_index(event.object) << " by " << event.evidence.rule;
    }
  }
  EXPECT_EQ(frames, 300);
  EXPECT_GT(added, 0) << "a pipeline that sees nothing has no false changes either";
}

}  // namespace
}  // namespace pocd

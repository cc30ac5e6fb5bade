// pocd_evaluate as a user runs it: what it is told, what it writes.
#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "run_command.hpp"

namespace pocd {
namespace {

const std::filesystem::path kRoot = POCD_SOURCE_DIR;

CommandResult evaluate(const std::filesystem::path& output, const std::vector<std::string>& more) {
  std::vector<std::string> command{std::string(POCD_BIN_DIR) + "/pocd_evaluate",
                                   "--config",
                                   (kRoot / "config/simulated.yaml").string(),
                                   "--run",
                                   (kRoot / "test/integration/data/two_drives.yaml").string(),
                                   "--methods",
                                   "pocd",
                                   "--no-reference",
                                   "--no-pictures",
                                   "--output",
                                   output.string()};
  for (const char* change : {"width=64", "height=36", "fx=46", "fy=46", "cx=31.5", "cy=17.5"}) {
    command.insert(command.end(), {"--sim", change});
  }
  command.insert(command.end(), more.begin(), more.end());
  return run_command(command);
}

/// Rows of scores.csv by column; without the column of CPU times.
std::vector<std::map<std::string, std::string>> scores(const std::filesystem::path& output) {
  std::istringstream text(read_text(output / "scores.csv"));
  const auto cells_of = [](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::string line;
  std::getline(text, line);
  const std::vector<std::string> names = cells_of(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(text, line)) {
    const std::vector<std::string> cells = cells_of(line);
    EXPECT_EQ(cells.size(), names.size()) << line;
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < cells.size(); ++i) row[names[i]] = cells[i];
    row.erase("cpu_ms_per_frame");
  }
  return rows;
}

TEST(PocdEvaluate, SimChangesEveryScenario) {
  const TemporaryFolder folder;
  const auto frames = [&](const std::string& change) {
    const CommandResult result =
        evaluate(folder.path(), {"--seeds", "1", "--sim", "frame_rate_hz=" + change});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return std::stoi(scores(folder.path()).at(0).at("frames"));
  };
  const int at_10_hz = frames("10"), at_5_hz = frames("5");
  EXPECT_GT(at_5_hz, 50);
  EXPECT_NEAR(2 * at_5_hz, at_10_hz, 4);

  const auto recall = [&](const std::vector<std::string>& more) {
    EXPECT_EQ(evaluate(folder.path(), more).exit_code, 0);
    return std::stod(scores(folder.path()).at(0).at("recall_truth"));
  };
  EXPECT_GT(recall({"--seeds", "1"}), 90.0);
  EXPECT_LT(recall({"--seeds", "1", "--sim", "sensor.random_hole_share=0.99"}), 60.0)
      << "the sensor hardly sees anything";
}

TEST(PocdEvaluate, WrongChangesAreUsageErrorsThatNameThem) {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"frame_rate=5", "frame_rate_hz"},    // the likely intended one
      {"frame_rate_hz=0", "out of range"},  //
      {"sensor.edge_hole_px=x", "edge_hole_px"},
      {"frame_rate_hz", "frame_rate_hz"}};
  for (const auto& [change, said] : cases) {
    const CommandResult result = evaluate(folder.path(), {"--sim", change});
    EXPECT_EQ(result.exit_code, 2) << change << ": " << result.err;
    EXPECT_NE(result.err.find("--sim " + change), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(said), std::string::npos) << result.err;
  }
}

TEST(PocdEvaluate, SameScoresWhateverTheNumberOfJobs) {
  const TemporaryFolder one, two;
  EXPECT_EQ(evaluate(one.path(), {"--seeds", "1,2", "--jobs", "1"}).exit_code, 0);
  EXPECT_EQ(evaluate(two.path(), {"--seeds", "1,2", "--jobs", "2"}).exit_code, 0);
  EXPECT_EQ(scores(one.path()).size(), 2u);
  EXPECT_EQ(scores(one.path()), scores(two.path()));
  EXPECT_EQ(read_text(one.path() / "changes.csv"), read_text(two.path() / "changes.csv"));
}

}  // namespace
}  // namespace pocd

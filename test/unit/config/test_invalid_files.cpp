// Every file of test/data/invalid/config has one defect (one file has several) and says in its
// "# expect:" lines what the error must be after the file's name, or in an "# expect-rule:" line
// the whole error.
#include <gtest/gtest.h>

#include <algorithm>

#include "config_fixture.hpp"
#include "pocd/common/check.hpp"

namespace pocd {
namespace {

std::vector<std::filesystem::path> invalid_files() {
  std::vector<std::filesystem::path> files;
  const std::filesystem::path folder =
      std::filesystem::path(POCD_SOURCE_DIR) / "test/data/invalid/config";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  std::sort(files.begin(), files.end());
  return files;
}

std::string expected_error(const std::filesystem::path& file) {
  const std::string mark = "# expect: ";
  const std::string rule_mark = "# expect-rule: ";
  std::vector<std::string> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(rule_mark, 0) == 0) return line.substr(rule_mark.size());
    if (line.rfind(mark, 0) == 0) lines.push_back(file.string() + line.substr(mark.size()));
  }
  if (lines.size() == 1) return lines.front();
  std::string text = "configuration has " + std::to_string(lines.size()) + " errors:";
  for (const std::string& line : lines) text += "\n  " + line;
  return text;
}

class InvalidConfigFile : public testing::TestWithParam<std::filesystem::path> {};

TEST_P(InvalidConfigFile, IsRefusedWithTheExpectedText) {
  PipelineConfig config;
  try {
    load_config(config, {GetParam()});
    FAIL() << GetParam() << " was accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(), expected_error(GetParam()));
  }
}

INSTANTIATE_TEST_SUITE_P(Files, InvalidConfigFile, testing::ValuesIn(invalid_files()),
                         [](const auto& info) { return info.param.stem().string(); });

}  // namespace
}  // namespace pocd

#include "text_file.hpp"

#include <gtest/gtest.h>

#include "pocd/common/check.hpp"
#include "scratch_folder.hpp"

namespace pocd {
namespace {

TEST(TextFile, ReadsNumbersAndSkipsCommentsAndBlanks) {
  const ScratchFolder folder;
  folder.write("m.txt", "# matrix\n\n1 2.5e0 -3\r\n +4,5\t6 \n");
  const Eigen::MatrixXd m = read_matrix(folder / "m.txt", 2, 3);
  EXPECT_EQ(m(0, 1), 2.5);
  EXPECT_EQ(m(0, 2), -3.0);
  EXPECT_EQ(m(1, 0), 4.0);
  EXPECT_EQ(m(1, 2), 6.0);
}

TEST(TextFile, ErrorsNameFileAndLine) {
  const ScratchFolder folder;
  const auto error_of = [&](const std::string& text) -> std::string {
    folder.write("m.txt", text);
    try {
      read_matrix(folder / "m.txt", 2, 2);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::pair<std::string, std::string> cases[] = {
      {"1 2\n3\n", "m.txt:2: has 1 values"},  {"1 2\n3 4 5\n", "m.txt:2: has 3 values"},
      {"1 x\n3 4\n", "m.txt:1: 'x'"},         {"1 2\n\n3 nan\n", "m.txt:3: 'nan'"},
      {"1 2\n3 inf\n", "m.txt:2: 'inf'"},     {"1 2\n3 4e999\n", "m.txt:2: '4e999'"},
      {"1 2.5.1\n3 4\n", "m.txt:1: '2.5.1'"}, {"1 2\n", "m.txt: has 1 lines"}};
  for (const auto& [text, expected] : cases) {
    EXPECT_NE(error_of(text).find(expected), std::string::npos) << text << " -> " << error_of(text);
  }
  EXPECT_EQ(error_of("1 2\n3 4\n"), "");
  EXPECT_THROW(read_lines(folder / "missing.txt"), InputError);
}

}  // namespace
}  // namespace pocd

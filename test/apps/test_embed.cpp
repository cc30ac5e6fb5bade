// The core in another program, built as its author would: outside of the workspace, against the
// installed prefix.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "../unit/datasets/scratch_folder.hpp"
#include "run_command.hpp"

namespace pocd {
namespace {

TEST(Embed, FortyLinesTellWhatComesAndGoes) {
  const std::string prefix = POCD_BIN_DIR "/..", example = prefix + "/share/pocd_core/examples/embed";
  std::stringstream text;
  text << std::ifstream(example + "/embed.cpp").rdbuf();
  const std::string source = text.str();
  ASSERT_FALSE(source.empty()) << example << " is not installed";
  EXPECT_LE(std::count(source.begin(), source.end(), '\n'), 40) << "is to be read at a glance";

  const ScratchFolder folder;
  const std::string build = folder.path().string();
  const CommandResult configured =
      run_command({POCD_CMAKE, "-S", example, "-B", build, "-DCMAKE_PREFIX_PATH=" + prefix,
                   "-DCMAKE_CXX_COMPILER_LAUNCHER=" POCD_LAUNCHER});
  ASSERT_EQ(configured.exit_code, 0) << configured.err;
  const CommandResult built = run_command({POCD_CMAKE, "--build", build});
  ASSERT_EQ(built.exit_code, 0) << built.out << built.err;
  const CommandResult ran = run_command({build + "/embed"});
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_NE(ran.out.find("ADDED object 1"), std::string::npos) << ran.out;
  EXPECT_NE(ran.out.find("REMOVED object 1"), std::string::npos) << ran.out;

  const CommandResult libraries = run_command({"ldd", build + "/embed"});
  EXPECT_EQ(libraries.exit_code, 0);
  for (const char* unwanted : {"gdal", "pcl", "yaml", "imgcodecs", "embree"}) {
    EXPECT_EQ(libraries.out.find(unwanted), std::string::npos) << libraries.out;
  }
}

}  // namespace
}  // namespace pocd

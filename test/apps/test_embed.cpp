// The example that embeds the core, built as its reader would: outside of the workspace, against
// the installed prefix, by its core component alone.
#include <gtest/gtest.h>

#include <algorithm>

#include "run_command.hpp"

namespace pocd {
namespace {

const std::string kPrefix = POCD_BIN_DIR "/..";

CommandResult configure(const std::string& source, const std::string& build) {
  // None of these is asked for, though all may be installed.
  return run_command({POCD_CMAKE, "-S", source, "-B", build, "-DCMAKE_PREFIX_PATH=" + kPrefix,
                      "-DCMAKE_CXX_COMPILER_LAUNCHER=" POCD_LAUNCHER, "-DCMAKE_BUILD_TYPE=Release",
                      "-DCMAKE_CXX_FLAGS=" POCD_CXX_FLAGS, "-DCMAKE_DISABLE_FIND_PACKAGE_PCL=ON",
                      "-DCMAKE_DISABLE_FIND_PACKAGE_embree=ON",
                      "-DCMAKE_DISABLE_FIND_PACKAGE_yaml-cpp=ON"});
}

TEST(Embed, FramesInChangesOut) {
  const std::string source = kPrefix + "/share/pocd_core/examples/embed";
  const std::string text = read_text(source + "/embed.cpp");
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 40) << "is to be read at a glance";
  const TemporaryFolder folder;
  const std::string build = (folder.path() / "build").string();
  const CommandResult configured = configure(source, build);
  ASSERT_EQ(configured.exit_code, 0) << configured.err;
  const CommandResult built = run_command({POCD_CMAKE, "--build", build});
  ASSERT_EQ(built.exit_code, 0) << built.out << built.err;
  const CommandResult run = run_command({build + "/embed"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.err, "");
  EXPECT_NE(run.out.find("ADDED box at x = 1.8"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("REMOVED box at x = 1.8"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("0 objects are left"), std::string::npos) << run.out;
  const CommandResult libraries = run_command({"/usr/bin/ldd", build + "/embed"});
  ASSERT_EQ(libraries.exit_code, 0) << libraries.err;
  for (const char* other : {"pcl", "gdal", "embree", "hdf5", "yaml", "sqlite", "fastrtps", "dnn"}) {
    EXPECT_EQ(libraries.out.find(other), std::string::npos) << other << "\n" << libraries.out;
  }
}

TEST(Embed, AComponentThatIsNoneIsNamed) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "CMakeLists.txt")
      << "cmake_minimum_required(VERSION 3.22)\nproject(wrong LANGUAGES CXX)\n"
         "find_package(pocd_core REQUIRED COMPONENTS core netwrok)\n";
  const CommandResult configured =
      configure(folder.path().string(), (folder.path() / "build").string());
  EXPECT_NE(configured.exit_code, 0);
  EXPECT_NE(configured.err.find("netwrok"), std::string::npos) << configured.err;
}

}  // namespace
}  // namespace pocd

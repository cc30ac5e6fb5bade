// An application that is no part of this repository, built against what is installed.
#include <gtest/gtest.h>

#include "bus_harness.hpp"

namespace pocd {
namespace {

// Those who follow the map need none of what only the data sets are read with.
TEST(Outside, ThePackagesAreFoundWithoutPclVtkAndQt) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "CMakeLists.txt")
      << "cmake_minimum_required(VERSION 3.22)\nproject(user LANGUAGES CXX)\n"
         "find_package(pocd_core REQUIRED)\nfind_package(pocd_dds REQUIRED)\n"
         "foreach(name PCL VTK Qt5 Qt5Core Qt6)\n"
         "  get_property(looked GLOBAL PROPERTY PACKAGES_FOUND)\n"
         "  get_property(failed GLOBAL PROPERTY PACKAGES_NOT_FOUND)\n"
         "  if(name IN_LIST looked OR name IN_LIST failed)\n"
         "    message(FATAL_ERROR \"looked for ${name}\")\n  endif()\nendforeach()\n";
  std::vector<std::string> command{POCD_CMAKE,
                                   "-S",
                                   folder.path().string(),
                                   "-B",
                                   (folder.path() / "build").string(),
                                   "-G",
                                   POCD_GENERATOR,
                                   std::string("-DCMAKE_PREFIX_PATH=") + POCD_BIN_DIR + "/.."};
  for (const char* name : {"PCL", "VTK", "Qt5", "Qt6"}) {
    command.push_back(std::string("-DCMAKE_DISABLE_FIND_PACKAGE_") + name + "=ON");
  }
  const CommandResult configured = run_command(command);
  EXPECT_EQ(configured.exit_code, 0) << configured.out << configured.err;
}

TEST(Outside, ExampleBuildsAgainstTheInstalledPackageAndFollowsTheMap) {
  const TemporaryFolder folder;
  const std::string build = (folder.path() / "build").string();
  const CommandResult configured =
      run_command({POCD_CMAKE, "-S", source("pocd_dds/examples/map_mirror"), "-B", build, "-G",
                   POCD_GENERATOR, "-DCMAKE_CXX_FLAGS=" POCD_CXX_FLAGS,
                   std::string("-DCMAKE_PREFIX_PATH=") + POCD_BIN_DIR + "/.."});
  ASSERT_EQ(configured.exit_code, 0) << configured.out << configured.err;
  const CommandResult built = run_command({POCD_CMAKE, "--build", build});
  ASSERT_EQ(built.exit_code, 0) << built.out << built.err;

  const TestDomain domain;
  Process node(node_command(domain, {"--lossless"}));
  ASSERT_EQ(run_command(play_command(domain, {"--max-frames", "40"})).exit_code, 0);
  // In the face of the box in the east, before it, and far away.
  const std::pair<std::vector<std::string>, std::string> places[] = {
      {{"2.0", "0.2", "0.5"}, "occupied"},
      {{"1.85", "0.2", "0.5"}, "free"},
      {{"100", "100", "100"}, "not near any surface"}};
  for (const auto& [place, expected] : places) {
    const CommandResult followed =
        run_command({build + "/follow_map", domain.text(), place[0], place[1], place[2]});
    EXPECT_EQ(followed.exit_code, 0) << followed.out << followed.err;
    EXPECT_NE(followed.out.find("that place is " + expected), std::string::npos) << followed.out;
  }
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
}

}  // namespace
}  // namespace pocd

#include "view/static_files.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "pocd/common/check.hpp"
#include "run_command.hpp"

namespace pocd::view::testing {
namespace {

void write(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

TEST(StaticFiles, FindsItsFilesAndNothingElse) {
  TemporaryFolder folder;
  write(folder.path() / "page/index.html", std::string(5000, 'x'));
  write(folder.path() / "page/lib/a.js", "1");
  write(folder.path() / "secret.txt", "s");
  const StaticFiles files(folder.path() / "page");
  ASSERT_NE(files.find("/"), nullptr);
  EXPECT_EQ(files.find("/")->type, "text/html; charset=utf-8");
  EXPECT_LT(files.find("/")->gzip.size(), 200u);
  EXPECT_EQ(files.find("/lib/a.js")->bytes, "1");
  EXPECT_EQ(files.find("/lib/a.js")->gzip, "");  // would be longer
  EXPECT_NE(files.find("/index.html")->tag, files.find("/lib/a.js")->tag);
  for (const char* path : {"/../secret.txt", "/lib/../../secret.txt", "/lib", "/lib/", "//", "",
                           "/%2e%2e/secret.txt", "/lib/a.js/"}) {
    EXPECT_EQ(files.find(path), nullptr) << path;
  }
}

TEST(StaticFiles, NamesWhatIsWrong) {
  TemporaryFolder folder;
  EXPECT_THROW(StaticFiles{folder.path()}, InputError);
  write(folder.path() / "index.html", "");
  write(folder.path() / "core.dump", "");
  EXPECT_THROW(StaticFiles{folder.path()}, InputError);
}

}  // namespace
}  // namespace pocd::view::testing

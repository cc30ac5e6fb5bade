#include <gtest/gtest.h>

#include "config_fixture.hpp"
#include "pocd/common/check.hpp"

namespace pocd {
namespace {

AllKinds load_text(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const TemporaryFile file(text);
  AllKinds config;
  load_config(config, {file.path()}, overrides);
  return config;
}

std::string error_of(const std::vector<std::filesystem::path>& files,
                     const std::vector<std::string>& overrides) {
  AllKinds config;
  try {
    load_config(config, files, overrides);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(LoadConfig, ReadsEveryKind) {
  const AllKinds c = load_text(
      "real: 1e-3\nwhole: 5\nnatural: 18446744073709551615\nflag: true\ntext: two words\n"
      "word: green\ntexts: [x]\nitems: [{id: 4, name: fence}]\nnoise: {base_m: 0.02}\n");
  EXPECT_EQ(c.real, 1e-3);
  EXPECT_EQ(c.whole, 5);
  EXPECT_EQ(c.natural, 18446744073709551615ull);
  EXPECT_TRUE(c.flag);
  EXPECT_EQ(c.text, "two words");
  EXPECT_EQ(c.word, Word::kGreen);
  EXPECT_EQ(c.texts, std::vector<std::string>{"x"});
  ASSERT_EQ(c.items.size(), 1u);
  EXPECT_EQ(c.items[0].id, 4);
  EXPECT_EQ(c.items[0].name, "fence");
  EXPECT_EQ(c.items[0].role, ClassRole::kBackground);  // not given: the default
  EXPECT_EQ(c.noise.base_m, 0.02);
  EXPECT_EQ(c.noise.quadratic_per_m, DepthNoise{}.quadratic_per_m);
}

TEST(LoadConfig, EmptyFileAndEmptyGroupKeepDefaults) {
  EXPECT_EQ(load_text("").whole, AllKinds{}.whole);
  EXPECT_EQ(load_text("# nothing\nnoise:\n  # base_m: 0.1\n").noise.base_m, DepthNoise{}.base_m);
}

TEST(LoadConfig, LaterFileOverridesKeyByKeyAndReplacesLists) {
  const TemporaryFile first("whole: 1\nreal: 2\ntexts: [p, q, r]\nitems: [{id: 1}, {id: 2}]\n");
  const TemporaryFile second("whole: 3\ntexts: [z]\nitems: [{id: 9}]\n");
  AllKinds c;
  load_config(c, {first.path(), second.path()});
  EXPECT_EQ(c.whole, 3);
  EXPECT_EQ(c.real, 2.0);
  EXPECT_EQ(c.texts, std::vector<std::string>{"z"});
  ASSERT_EQ(c.items.size(), 1u);
  EXPECT_EQ(c.items[0].id, 9);
}

TEST(LoadConfig, OverridesComeLast) {
  const AllKinds c =
      load_text("noise: {base_m: 0.1}\n", {"noise.base_m=0.05", "text=a=b", "texts=[u, v]"});
  EXPECT_EQ(c.noise.base_m, 0.05);
  EXPECT_EQ(c.text, "a=b");
  EXPECT_EQ(c.texts, (std::vector<std::string>{"u", "v"}));
}

TEST(LoadConfig, BadOverridesAreNamed) {
  EXPECT_EQ(error_of({}, {"noise.base_n=1"}),
            "--set noise.base_n=1: noise.base_n: unknown key, did you mean base_m?");
  EXPECT_EQ(error_of({}, {"whole=many"}),
            "--set whole=many: whole: expected a whole number, got \"many\"");
  EXPECT_EQ(error_of({}, {"whole"}), "--set whole: expected GROUP.KEY=VALUE");
  EXPECT_EQ(error_of({}, {"noise.=1"}), "--set noise.=1: expected GROUP.KEY=VALUE");
}

// Not only what is missing: a name too long for the system, and a link that leads to itself.
TEST(LoadConfig, FilesThatCannotBeReachedAreNamed) {
  const std::string too_long = std::string(300, 'x') + "/x.yaml";
  EXPECT_EQ(error_of({too_long}, {}), too_long + ": cannot be read");
  const TemporaryFile loop("");
  std::filesystem::remove(loop.path());
  std::filesystem::create_symlink(loop.path(), loop.path());
  EXPECT_EQ(error_of({loop.path()}, {}), loop.path().string() + ": cannot be read");
}

TEST(LoadConfig, RulesBetweenParametersAreChecked) {
  EXPECT_EQ(error_of({}, {"flag=true", "texts=[]"}), "flag needs texts");
}

TEST(LoadConfig, AllErrorsOfAllSourcesAreListedAtOnce) {
  const TemporaryFile file("flag: yes\nwrod: red\n");
  const std::string path = file.path().string();
  EXPECT_EQ(error_of({file.path(), "/nowhere/at_all.yaml", "/tmp"}, {"real=x"}),
            "configuration has 5 errors:\n  " + path +
                ":1: flag: expected true or false, got \"yes\"\n  " + path +
                ":2: wrod: unknown key, did you mean word?\n"
                "  /nowhere/at_all.yaml: cannot be read\n"
                "  /tmp: is a folder, not a file\n"
                "  --set real=x: real: expected a number [m], got \"x\"");
}

}  // namespace
}  // namespace pocd

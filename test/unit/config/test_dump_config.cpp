#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "config_fixture.hpp"
#include "pocd/common/random.hpp"

namespace pocd {
namespace {

AllKinds round_trip(const AllKinds& config) {
  const TemporaryFile file(dump_config(config));
  AllKinds loaded;
  loaded.texts.clear();
  load_config(loaded, {file.path()});
  return loaded;
}

TEST(DumpConfig, LoadsBackToTheSameBits) {
  Random random(11);
  for (int i = 0; i < 200; ++i) {
    AllKinds config;
    const std::uint64_t bits = random.next();
    std::memcpy(&config.real, &bits, sizeof(bits));
    if (!std::isfinite(config.real) || std::abs(config.real) > 1e308) continue;
    config.natural = random.below(1000000000000000000ull);
    config.whole = -static_cast<int>(random.below(100));
    config.flag = random.below(2) == 1;
    const AllKinds loaded = round_trip(config);
    EXPECT_EQ(std::memcmp(&loaded.real, &config.real, sizeof(double)), 0) << config.real;
    EXPECT_EQ(loaded.natural, config.natural);
    EXPECT_EQ(loaded.whole, config.whole);
    EXPECT_EQ(loaded.flag, config.flag);
  }
}

TEST(DumpConfig, KeepsTextsThatLookLikeSomethingElse) {
  for (const char* text : {"", "true", "~", "null", "7", "a: b", "# no comment", " spaces ",
                           "\"q\"", "line\nbreak", "back\\slash", "[list]", "\xc3\xa4"}) {
    AllKinds config;
    config.text = text;
    config.texts = {text, "second"};
    config.items.resize(1);
    config.items[0].name = text;
    const AllKinds loaded = round_trip(config);
    EXPECT_EQ(loaded.text, text);
    EXPECT_EQ(loaded.texts, config.texts);
    EXPECT_EQ(loaded.items.at(0).name, text);
  }
}

TEST(DumpConfig, KeepsEmptyLists) {
  AllKinds config;
  config.texts.clear();
  EXPECT_TRUE(round_trip(config).texts.empty());
}

TEST(ParametersMarkdown, HasEveryParameterWithDefaultRangeAndMeaning) {
  const std::string page = parameters_markdown<AllKinds>();
  EXPECT_NE(page.find("| `real` | `0.5` | -1e+308 to 1e+308 m | A real number [m]. |\n"),
            std::string::npos);
  EXPECT_NE(page.find("| `word` | `red` | red, green | One of \\| two words. |\n"),
            std::string::npos);
  EXPECT_NE(page.find("| `share` | `0.5` | 0 to 100000 | The mean E[v]. |\n"), std::string::npos);
  EXPECT_NE(page.find("\n## noise\n\nA group.\n\n| parameter |"), std::string::npos);
  EXPECT_NE(page.find("| `noise.base_m` | `0.004` | 0 to 0.2 m |"), std::string::npos);
  EXPECT_NE(page.find("\n## items[]\n\nEach entry of `items`."), std::string::npos);
  EXPECT_NE(page.find("| `items[].role` | `background` |"), std::string::npos);
}

}  // namespace
}  // namespace pocd

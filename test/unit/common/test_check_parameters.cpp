// Values that C++ code has set are checked as those of files are.
#include <gtest/gtest.h>

#include <cmath>

#include "pocd/common/check.hpp"
#include "pocd/common/check_parameters.hpp"

namespace pocd {
namespace {

enum class Mode { kFast, kSlow };
EnumWords<Mode> words_of(Mode) { return {{Mode::kFast, "fast"}, {Mode::kSlow, "slow"}}; }

struct Item {
  int id = 0;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit("id", id, Range{0, 9}, "A number.");
  }
};

struct Group {
  double length_m = 1.0;
  std::uint64_t seed = 1;
  Mode mode = Mode::kFast;
  std::vector<Item> list;
  std::vector<std::string> inconsistencies() const {
    if (mode == Mode::kFast && seed == 3) return {"seed: 3 is slow"};
    return {};
  }
  template <class Visitor>
  void describe(Visitor& visit) {
    visit("length_m", length_m, Range{0.5, 2.0}, "A length [m].");
    visit("seed", seed, Range{1, 5}, "A seed.");
    visit("mode", mode, "How.");
    visit("list", list, "Items.");
  }
};

struct Sample {
  Group group;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit.group("group", group, "A group.");
  }
};

std::string problem_of(const Sample& sample) {
  try {
    check_parameters(sample, "sample");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(CheckParameters, DefaultsAreAllowed) { EXPECT_EQ(problem_of({}), ""); }

TEST(CheckParameters, FieldValueAndWhatIsAllowedAreNamed) {
  Sample sample;
  sample.group.length_m = 2.5;
  EXPECT_EQ(problem_of(sample),
            "sample: group.length_m: 2.5 is out of range, allowed are 0.5 to 2 m");
  sample.group.length_m = std::nan("");
  EXPECT_NE(problem_of(sample).find("group.length_m: nan"), std::string::npos);
  sample = {};
  sample.group.seed = 6;
  EXPECT_EQ(problem_of(sample), "sample: group.seed: 6 is out of range, allowed are 1 to 5");
  sample = {};
  sample.group.mode = static_cast<Mode>(7);
  EXPECT_EQ(problem_of(sample), "sample: group.mode: \"7\" is not one of: fast, slow");
  sample = {};
  sample.group.list = {{1}, {10}};
  EXPECT_EQ(problem_of(sample), "sample: group.list[1].id: 10 is out of range, allowed are 0 to 9");
  sample = {};
  sample.group.seed = 3;
  EXPECT_EQ(problem_of(sample), "sample: group: seed: 3 is slow");
}

TEST(CheckParameters, AllProblemsAreSaidAtOnce) {
  Sample sample;
  sample.group.length_m = 0.0;
  sample.group.mode = static_cast<Mode>(-1);
  EXPECT_EQ(
      problem_of(sample),
      "sample: group.length_m: 0 is out of range, allowed are 0.5 to 2 m; group.mode: \"-1\" is "
      "not one of: fast, slow");
}

}  // namespace
}  // namespace pocd

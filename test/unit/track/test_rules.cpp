// Rules of objects' life: one table of names, and docs/method.md says of each when it holds.
#include "pocd/track/rules.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "pocd/pipeline/operator_word.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;
const fs::path kSource = POCD_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  EXPECT_TRUE(in) << file;
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string text_of_all(const fs::path& folder) {
  std::string all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".cpp" || ending == ".hpp") all += text_of(entry.path());
  }
  return all;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// What stands between backquotes.
std::vector<std::string> quoted(const std::string& cell) {
  std::vector<std::string> all;
  const std::regex quotes("`([^`]+)`");
  for (std::sregex_iterator it(cell.begin(), cell.end(), quotes), end; it != end; ++it)
    all.push_back((*it)[1]);
  return all;
}

/// Cells of the row of docs/method.md that begins with the rule's name.
std::vector<std::string> row_of(const std::string& name, const std::string& page) {
  const std::size_t at = page.find("\n| `" + name + "` |");
  if (at == std::string::npos) return {};
  std::stringstream row(page.substr(at + 2, page.find('\n', at + 1) - at - 2));
  std::vector<std::string> cells;
  for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell);
  return cells;
}

TEST(Rules, EachHasANameOfItsOwnThatIsReadBack) {
  std::size_t number = 0;
  for (const RuleInfo& info : all_rules()) {
    EXPECT_EQ(static_cast<std::size_t>(info.rule), number++) << info.name;
    const ObjectId other = info.rule == Rule::kJoined ? ObjectId{12} : ObjectId::kNone;
    const std::string text = rule_text(info.rule, other);
    EXPECT_EQ(text, info.rule == Rule::kJoined ? "joined_12" : info.name);
    EXPECT_EQ(rule_of(text), info.rule) << text;
  }
  EXPECT_EQ(static_cast<std::size_t>(Rule::kCandidateLapsed) + 1, number) << "all of the enum";
  for (const char* none : {"", "joined", "joined_", "joined_x", "joined_1x", "Found", "found "})
    EXPECT_FALSE(rule_of(none)) << none;
  EXPECT_THROW(rule_text(Rule::kJoined), std::logic_error) << "with whom?";
  EXPECT_THROW(rule_text(Rule::kGrew, ObjectId{1}), std::logic_error);
  for (const Arrival arrival : {Arrival::kUnknown, Arrival::kFound, Arrival::kArrived})
    EXPECT_EQ(rule_text(added_rule(arrival)), to_string(arrival));
}

// When, by which threshold, and what tests it; the threshold and the test exist.
TEST(Rules, EachIsDocumentedWithItsThresholdAndItsTest) {
  const std::string page = text_of(kSource / "docs/method.md");
  const std::string parameters = text_of(kSource / "docs/parameters.md");
  const std::string code = text_of_all(kSource / "pocd_core");
  const std::string tests = text_of_all(kSource / "test/unit");
  for (const RuleInfo& info : all_rules()) {
    const auto cells = row_of(info.name, page);
    ASSERT_EQ(cells.size(), 5u) << info.name
                                << ": no row in docs/method.md with rule, events, when, "
                                << "threshold, test";
    for (const EventKind kind : info.events)
      EXPECT_TRUE(contains(cells[1], to_string(kind))) << info.name << ": " << to_string(kind);
    for (const char* kind : {"ADDED", "UPDATED", "MOVED", "REMOVED"}) {
      const bool told = std::any_of(info.events.begin(), info.events.end(),
                                    [&](EventKind k) { return to_string(k) == std::string(kind); });
      const std::regex word(std::string("\\b") + kind + "\\b");
      EXPECT_EQ(std::regex_search(cells[1], word), told) << info.name << ": " << kind;
    }
    EXPECT_GT(cells[2].size(), 20u) << info.name;
    const auto thresholds = quoted(cells[3]);
    EXPECT_FALSE(thresholds.empty()) << info.name;
    for (const std::string& threshold : thresholds) {
      const bool constant =
          std::regex_search(code, std::regex("constexpr [a-z:_0-9]+ " + threshold + " = "));
      EXPECT_TRUE(constant || contains(parameters, "`" + threshold + "`"))
          << info.name << ": " << threshold << " is no parameter and no constant";
    }
    const auto names = quoted(cells[4]);
    EXPECT_FALSE(names.empty()) << info.name;
    for (const std::string& name : names) {
      const std::size_t dot = name.find('.');
      ASSERT_NE(dot, std::string::npos) << name;
      const std::regex test("TEST(_F|_P)?\\(" + name.substr(0, dot) + ",\\s+" +
                            name.substr(dot + 1) + "\\)");
      EXPECT_TRUE(std::regex_search(tests, test)) << info.name << ": no test " << name;
    }
  }
}

TEST(Rules, TheirNamesAreWrittenInOnePlace) {
  for (const char* folder : {"pocd_core/src", "pocd_core/include", "pocd_core/apps", "pocd_dds"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kSource / folder)) {
      const fs::path& file = entry.path();
      if ((file.extension() != ".cpp" && file.extension() != ".hpp") ||
          file.filename() == "rules.cpp") {
        continue;
      }
      const std::string code = std::regex_replace(text_of(file), std::regex("//[^\n]*"), "");
      for (const RuleInfo& info : all_rules()) {
        // Words of one syllable mean other things elsewhere.
        if (!contains(info.name, "_")) continue;
        EXPECT_FALSE(contains(code, "\"" + std::string(info.name) + "\""))
            << file << ": " << info.name;
      }
    }
  }
}

// The live page says each rule in words, and no rule that there is not.
TEST(Rules, ThePageHasWordsForEach) {
  const std::string script = text_of(kSource / "pocd_dds/view/page/words.js");
  const std::size_t begin = script.find("const rules = {"), end = script.find("\n};", begin);
  ASSERT_NE(end, std::string::npos);
  const std::string table = script.substr(begin, end - begin);
  std::set<std::string> expected, found;
  for (const RuleInfo& info : all_rules()) {
    if (!info.events.empty() && info.rule != Rule::kJoined) expected.insert(info.name);
  }
  EXPECT_TRUE(contains(script, "/^joined_")) << "with the other one's number";
  for (int kind = 0; kind < kWordKinds; ++kind)
    expected.insert(to_string(static_cast<WordKind>(kind)));
  const std::regex key("\n  ([a-z_]+): \"");
  for (std::sregex_iterator it(table.begin(), table.end(), key), last; it != last; ++it)
    found.insert((*it)[1]);
  EXPECT_EQ(found, expected);
}

}  // namespace
}  // namespace pocd

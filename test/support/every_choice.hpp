// Tries every parameter of a configuration that is a word of an enum. They are found by describe(),
// so a new one is tried, too.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"

namespace pocd::test {

struct ChoiceFound {
  std::string path;  ///< "classes.list[0].role"
  std::string word;
  std::vector<std::string> choices;
  std::string before, after;  ///< what --set has around the word: "classes={list: [{role: ", "}]}"
};

class ChoiceFinder final : public ParameterSink {
 public:
  /// `defaults`: looks into an entry of each list as it is by default, not into those there are.
  explicit ChoiceFinder(bool defaults) : defaults_(defaults) {}

  std::vector<ChoiceFound> found;

  void choice(const char* name, std::string& word, const std::vector<std::string>& choices,
              const char*) override {
    enter(name, "", "", "");
    found.push_back({here_.path, word, choices, here_.before, here_.after});
    end_group();
  }
  void items(const char* name, ItemList& list, const char*) override {
    for (std::size_t i = 0; i < (defaults_ ? 1 : list.size()); ++i) {
      enter(name, "[" + std::to_string(i) + "].", "[", "]");
      if (defaults_) {
        list.describe_default(*this);
      } else {
        list.describe_item(i, *this);
      }
      end_group();
    }
  }
  void begin_group(const char* name, const char*) override { enter(name, ".", "", ""); }
  void end_group() override {
    here_ = outside_.back();
    outside_.pop_back();
  }
  void real(const char*, double&, const Range&, const char*) override {}
  void integer(const char*, int&, const Range&, const char*) override {}
  void natural(const char*, std::uint64_t&, const Range&, const char*) override {}
  void boolean(const char*, bool&, const char*) override {}
  void text(const char*, std::string&, const char*) override {}
  void texts(const char*, std::vector<std::string>&, const char*) override {}

 private:
  struct Place {
    std::string path, before, after;
  };
  void enter(const std::string& name, const std::string& more, const std::string& open,
             const std::string& close) {
    outside_.push_back(here_);
    const bool first = here_.path.empty();
    here_.path += name + more;
    here_.before += (first ? name + "=" : "{" + name + ": ") + open;
    here_.after = close + (first ? "" : "}") + here_.after;
  }

  bool defaults_;
  Place here_;
  std::vector<Place> outside_;
};

/// Empty: loaded.
template <class Config>
std::string load_error(Config& config, const std::string& assignment) {
  try {
    load_config(config, {}, {assignment});
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// Expects of each that other words are refused with the parameter's name and the choices, and that
/// the choices are taken and written again. The paths that were tried.
template <class Config>
std::vector<std::string> try_every_choice() {
  std::vector<std::string> paths;
  ChoiceFinder all(true);
  Config defaults;
  show_parameters(defaults, all);
  for (const ChoiceFound& one : all.found) {
    SCOPED_TRACE(one.path);
    paths.push_back(one.path);
    std::string list;
    for (const std::string& word : one.choices) list += (list.empty() ? "" : ", ") + word;
    const std::vector<std::string> bad{"no_such_word", "", "0", "1", one.choices[0] + "x"};
    for (const std::string& word : bad) {
      Config config;
      const std::string error = load_error(config, one.before + "\"" + word + "\"" + one.after);
      EXPECT_NE(error.find(one.path + ": \"" + word + "\" is not one of: " + list),
                std::string::npos)
          << error;
    }
    for (const std::string& word : one.choices) {
      Config config;
      const std::string error = load_error(config, one.before + word + one.after);
      EXPECT_EQ(error.find("is not one of"), std::string::npos) << error;
      ChoiceFinder loaded(false);
      show_parameters(config, loaded);
      const auto same = [&](const ChoiceFound& c) { return c.path == one.path; };
      const auto at = std::find_if(loaded.found.begin(), loaded.found.end(), same);
      EXPECT_TRUE(at != loaded.found.end() && at->word == word) << word;
      EXPECT_NE(dump_config(config).find(": " + word + "\n"), std::string::npos);
    }
  }
  return paths;
}

}  // namespace pocd::test

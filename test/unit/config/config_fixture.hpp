// Small described structs, and files that last as long as a test.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "pocd/config/config_io.hpp"
#include "pocd/input/class_map.hpp"
#include "pocd/input/depth_noise.hpp"
#include "pocd/pipeline/pipeline_config.hpp"

namespace pocd {

enum class Word { kRed, kGreen };
inline EnumWords<Word> words_of(Word) { return {{Word::kRed, "red"}, {Word::kGreen, "green"}}; }

/// Every kind of parameter that a describe() can have.
struct AllKinds {
  double real = 0.5;
  double share = 0.5;
  int whole = -3;
  std::uint64_t natural = 7;
  bool flag = false;
  std::string text = "plain";
  Word word = Word::kRed;
  std::vector<std::string> texts{"a", "b"};
  std::vector<ClassInfo> items;
  DepthNoise noise;

  std::vector<std::string> inconsistencies() const {
    if (flag && texts.empty()) return {"flag needs texts"};
    return {};
  }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("real", real, Range{-1e308, 1e308}, "A real number [m].");
    visit("share", share, Range{0, 100000}, "The mean E[v].");
    visit("whole", whole, Range{-100, 100}, "A whole number.");
    visit("natural", natural, Range{0, 1.9e19}, "A natural number.");
    visit("flag", flag, "A switch.");
    visit("text", text, "Any text.");
    visit("word", word, "One of | two words.");
    visit("texts", texts, "Some texts.");
    visit("items", items, "Some structs.");
    visit.group("noise", noise, "A group.");
  }
};

/// A file with the given content, removed at the end.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& content) {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("pocd_test_" + std::to_string(getpid()) + "_" + std::to_string(count++) + ".yaml");
    std::ofstream(path_) << content;
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace pocd

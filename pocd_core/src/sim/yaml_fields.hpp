// Strict access to a YAML map: every key must be asked for, every value must have its type.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "pocd/common/enum_words.hpp"

namespace pocd {

/// Reads a file; throws InputError naming file and line when it cannot be read or parsed.
YAML::Node load_yaml_file(const std::filesystem::path& file);

class YamlFields {
 public:
  /// `where` begins every error text. Keys not in `map` are looked up in `fallback`.
  YamlFields(YAML::Node map, std::string where, YAML::Node fallback = {});

  const std::string& where() const { return where_; }
  bool has(const std::string& key) const;
  /// The node itself, marked as known; throws when missing.
  YAML::Node node(const std::string& key);

  double number(const std::string& key);
  double number(const std::string& key, double otherwise) {
    return has(key) ? number(key) : otherwise;
  }
  int integer(const std::string& key);
  int integer(const std::string& key, int otherwise) { return has(key) ? integer(key) : otherwise; }
  bool boolean(const std::string& key, bool otherwise);
  std::string text(const std::string& key);
  std::string text(const std::string& key, const std::string& otherwise) {
    return has(key) ? text(key) : otherwise;
  }
  /// A word of an enum.
  template <class Enum>
  Enum choice(const std::string& key, Enum otherwise) {
    const std::string word = text(key, word_of(otherwise));
    const std::optional<Enum> value = value_of<Enum>(word);
    if (!value) no_choice(key, word, choices_of<Enum>());
    return *value;
  }
  /// A list of exactly `count` finite numbers.
  Eigen::VectorXd numbers(const std::string& key, int count);

  /// Throws InputError listing every key that nobody asked for.
  void finish() const;
  [[noreturn]] void fail(const std::string& key, const std::string& what) const;

 private:
  [[noreturn]] void no_choice(const std::string& key, const std::string& word,
                              const std::vector<std::string>& choices) const;

  YAML::Node map_, fallback_;
  std::string where_;
  std::set<std::string> known_;
};

/// A list of exactly `count` finite numbers; `where` begins the error text.
Eigen::VectorXd number_list(const YAML::Node& node, int count, const std::string& where);

}  // namespace pocd

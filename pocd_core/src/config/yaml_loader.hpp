// Walks described parameters beside one YAML document and notes all that does not fit.
#pragma once

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>
#include <vector>

#include "pocd/common/parameter_sink.hpp"

namespace pocd::config_detail {

/// Lays one document over the values of the struct that it visits. Values that do not fit are left.
class YamlLoader final : public ParameterSink {
 public:
  /// `source` begins every problem's line; `with_lines`: followed by the line in the file.
  YamlLoader(std::string source, bool with_lines, const YAML::Node& root);

  /// After the walk: all problems in the order of the file.
  std::vector<std::string> finish();

  void real(const char* name, double& value, const Range& range, const char* doc) override;
  void integer(const char* name, int& value, const Range& range, const char* doc) override;
  void natural(const char* name, std::uint64_t& value, const Range& range,
               const char* doc) override;
  void boolean(const char* name, bool& value, const char* doc) override;
  void text(const char* name, std::string& value, const char* doc) override;
  void choice(const char* name, std::string& word, const std::vector<std::string>& choices,
              const char* doc) override;
  void texts(const char* name, std::vector<std::string>& values, const char* doc) override;
  void items(const char* name, ItemList& list, const char* doc) override;
  void begin_group(const char* name, const char* doc) override;
  void end_group() override;

 private:
  struct Entry {
    YAML::Node value;
    int line;  ///< of its key, from 1
  };
  struct Level {
    std::optional<YAML::Node> node;  ///< nothing: the document does not have this group
    std::string path;
    std::vector<std::string> known = {};
  };
  struct UnknownKey {
    std::string key, path;
    int line;
    std::vector<std::string> known;
  };
  struct Problem {
    int line;
    std::string text;
  };

  std::string path(const std::string& name) const;
  std::optional<Entry> find(const std::string& name);
  void enter(const std::optional<Entry>& entry, const std::string& group_path);
  void check_keys(const Level& level);
  std::string hint(const UnknownKey& unknown) const;
  void report(int line, const std::string& parameter, const std::string& text);
  bool is_text(const Entry& entry, const std::string& name);
  bool is_list(const Entry& entry, const std::string& name);
  template <class Parsed, class Value, class Parse>
  void number(const char* name, Value& value, const Range& range, const char* doc,
              const char* expected, Parse parse);

  std::string source_;
  bool with_lines_;
  std::vector<Level> levels_;
  std::vector<std::string> known_paths_;
  std::vector<UnknownKey> unknown_;
  std::vector<Problem> problems_;
};

}  // namespace pocd::config_detail

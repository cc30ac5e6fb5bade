#include "yaml_loader.hpp"

#include <algorithm>
#include <map>

#include "../common/parameter_text.hpp"

namespace pocd::config_detail {
namespace {

std::string kind_of(const YAML::Node& node) {
  if (node.IsNull()) return "nothing";
  if (node.IsSequence()) return "a list";
  if (node.IsMap()) return "a group of keys";
  return "\"" + node.Scalar() + "\"";
}

/// A scalar without quotes (yaml-cpp tags quoted ones "!").
bool is_plain(const YAML::Node& node) { return node.IsScalar() && node.Tag() != "!"; }

int line_of(const YAML::Node& node) { return node.Mark().line + 1; }

std::string item_name(const std::string& list, std::size_t index) {
  return list + "[" + std::to_string(index) + "]";
}

std::string scalar_or_nothing(const YAML::Node& node) {
  return node.IsScalar() ? node.Scalar() : "";
}

}  // namespace

YamlLoader::YamlLoader(std::string source, bool with_lines, const YAML::Node& root)
    : source_(std::move(source)), with_lines_(with_lines) {
  levels_.push_back({std::nullopt, ""});
  if (!root.IsDefined() || root.IsNull()) return;  // an empty file changes nothing
  if (root.IsMap()) {
    levels_.back().node = root;
  } else {
    report(line_of(root), "", "expected \"key: value\" lines, got " + kind_of(root));
  }
}

std::vector<std::string> YamlLoader::finish() {
  check_keys(levels_.back());
  for (const UnknownKey& unknown : unknown_) {
    report(unknown.line, unknown.path, "unknown key" + hint(unknown));
  }
  std::stable_sort(problems_.begin(), problems_.end(),
                   [](const Problem& a, const Problem& b) { return a.line < b.line; });
  std::vector<std::string> lines;
  for (const Problem& p : problems_) {
    lines.push_back(source_ + (with_lines_ ? ":" + std::to_string(p.line) : "") + ": " + p.text);
  }
  return lines;
}

void YamlLoader::real(const char* name, double& value, const Range& range, const char* doc) {
  number<double>(name, value, range, doc, "a number", parse_real);
}

void YamlLoader::integer(const char* name, int& value, const Range& range, const char* doc) {
  number<std::int64_t>(name, value, range, doc, "a whole number", parse_integer);
}

void YamlLoader::natural(const char* name, std::uint64_t& value, const Range& range,
                         const char* doc) {
  number<std::uint64_t>(name, value, range, doc, "a whole number, 0 or more", parse_natural);
}

void YamlLoader::boolean(const char* name, bool& value, const char*) {
  const std::optional<Entry> entry = find(name);
  if (!entry) return;
  const std::string text = is_plain(entry->value) ? entry->value.Scalar() : "";
  if (text == "true" || text == "false") {
    value = text == "true";
  } else {
    report(entry->line, path(name), "expected true or false, got " + kind_of(entry->value));
  }
}

void YamlLoader::text(const char* name, std::string& value, const char*) {
  const std::optional<Entry> entry = find(name);
  if (entry && is_text(*entry, name)) value = entry->value.Scalar();
}

void YamlLoader::choice(const char* name, std::string& word,
                        const std::vector<std::string>& choices, const char*) {
  const std::optional<Entry> entry = find(name);
  if (!entry || !is_text(*entry, name)) return;
  const std::string text = entry->value.Scalar();
  if (std::find(choices.begin(), choices.end(), text) != choices.end()) {
    word = text;
  } else {
    report(entry->line, path(name), not_one_of(text, choices));
  }
}

void YamlLoader::texts(const char* name, std::vector<std::string>& values, const char*) {
  const std::optional<Entry> entry = find(name);
  if (!entry || !is_list(*entry, name)) return;
  values.clear();
  for (const YAML::Node& item : entry->value) {
    if (is_text({item, line_of(item)}, item_name(name, values.size()))) {
      values.push_back(item.Scalar());
    }
  }
}

void YamlLoader::items(const char* name, ItemList& list, const char*) {
  const std::optional<Entry> entry = find(name);
  if (!entry || !is_list(*entry, name)) return;
  list.reset(entry->value.size());
  std::size_t index = 0;
  for (const YAML::Node& item : entry->value) {
    enter(Entry{item, line_of(item)}, path(item_name(name, index)));
    list.describe_item(index, *this);
    end_group();
    ++index;
  }
}

void YamlLoader::begin_group(const char* name, const char*) {
  std::optional<Entry> entry = find(name);
  if (entry && entry->value.IsNull()) entry.reset();  // a heading, all its keys commented out
  enter(entry, path(name));
}

void YamlLoader::end_group() {
  check_keys(levels_.back());
  levels_.pop_back();
}

std::string YamlLoader::path(const std::string& name) const {
  const std::string& parent = levels_.back().path;
  return parent.empty() ? name : parent + "." + name;
}

std::optional<YamlLoader::Entry> YamlLoader::find(const std::string& name) {
  Level& level = levels_.back();
  level.known.push_back(name);
  known_paths_.push_back(path(name));
  if (!level.node) return std::nullopt;
  for (const auto& pair : *level.node) {
    if (scalar_or_nothing(pair.first) == name) return Entry{pair.second, line_of(pair.first)};
  }
  return std::nullopt;
}

void YamlLoader::enter(const std::optional<Entry>& entry, const std::string& group_path) {
  std::optional<YAML::Node> node;
  if (entry && entry->value.IsMap()) {
    node = entry->value;
  } else if (entry) {
    report(entry->line, group_path, "expected a group of keys, got " + kind_of(entry->value));
  }
  levels_.push_back({node, group_path});
}

void YamlLoader::check_keys(const Level& level) {
  if (!level.node) return;
  std::map<std::string, int> first_line;
  for (const auto& pair : *level.node) {
    const std::string key = scalar_or_nothing(pair.first);
    const int line = line_of(pair.first);
    const auto [first, is_new] = first_line.emplace(key, line);
    if (!is_new) {
      report(line, path(key), "given twice, first in line " + std::to_string(first->second));
    } else if (std::find(level.known.begin(), level.known.end(), key) == level.known.end()) {
      unknown_.push_back({key, path(key), line, level.known});
    }
  }
}

std::string YamlLoader::hint(const UnknownKey& unknown) const {
  if (const auto sibling = closest(unknown.key, unknown.known)) {
    return ", did you mean " + *sibling + "?";
  }
  for (const std::string& known : known_paths_) {  // right name, wrong group
    const std::size_t dot = known.rfind('.');
    if (dot != std::string::npos && known.substr(dot + 1) == unknown.key) {
      return ", did you mean " + known + "?";
    }
  }
  return "; known here: " + join(unknown.known, ", ");
}

void YamlLoader::report(int line, const std::string& parameter, const std::string& text) {
  problems_.push_back({line, (parameter.empty() ? "" : parameter + ": ") + text});
}

bool YamlLoader::is_text(const Entry& entry, const std::string& name) {
  if (entry.value.IsScalar()) return true;
  report(entry.line, path(name), "expected a text, got " + kind_of(entry.value));
  return false;
}

bool YamlLoader::is_list(const Entry& entry, const std::string& name) {
  if (entry.value.IsSequence()) return true;
  report(entry.line, path(name), "expected a list, got " + kind_of(entry.value));
  return false;
}

template <class Parsed, class Value, class Parse>
void YamlLoader::number(const char* name, Value& value, const Range& range, const char* doc,
                        const char* expected, Parse parse) {
  const std::optional<Entry> entry = find(name);
  if (!entry) return;
  const std::optional<Parsed> parsed =
      is_plain(entry->value) ? parse(entry->value.Scalar()) : std::optional<Parsed>();
  if (!parsed) {
    const std::string unit = unit_of(doc).empty() ? "" : " [" + unit_of(doc) + "]";
    report(entry->line, path(name),
           std::string("expected ") + expected + unit + ", got " + kind_of(entry->value));
    return;
  }
  const double size = static_cast<double>(*parsed);
  if (size >= range.low && size <= range.high) {  // false for NaN
    value = static_cast<Value>(*parsed);
  } else {
    report(entry->line, path(name),
           entry->value.Scalar() + " is out of range, allowed are " + range_text(range, doc));
  }
}

}  // namespace pocd::config_detail

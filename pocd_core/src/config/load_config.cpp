#include <functional>

#include "../common/parameter_text.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/check_parameters.hpp"
#include "pocd/config/config_io.hpp"
#include "yaml_loader.hpp"

namespace pocd::config_detail {
namespace {

/// "a.b=c" as the document "a: {b: c}".
YAML::Node parse_override(const std::string& text) {
  const std::size_t equals = text.find('=');
  std::string names = text.substr(0, equals);
  if (equals == std::string::npos || names.empty() || names.back() == '.' || names.front() == '.' ||
      names.find("..") != std::string::npos) {
    throw InputError("expected GROUP.KEY=VALUE");
  }
  YAML::Node value = YAML::Load(text.substr(equals + 1));
  while (!names.empty()) {
    const std::size_t dot = names.rfind('.');
    const std::size_t begin = dot == std::string::npos ? 0 : dot + 1;
    YAML::Node parent(YAML::NodeType::Map);
    parent.force_insert(names.substr(begin), value);
    value.reset(parent);  // assignment would write into the child
    names.erase(begin == 0 ? 0 : dot);
  }
  return value;
}

YAML::Node read_file(const std::filesystem::path& file) {
  std::error_code unreadable;  // is said by what follows
  if (std::filesystem::is_directory(file, unreadable)) throw InputError("is a folder, not a file");
  const std::vector<YAML::Node> documents = YAML::LoadAllFromFile(file.string());
  if (documents.size() > 1) throw InputError("holds more than one YAML document");
  return documents.empty() ? YAML::Node() : documents.front();
}

void overlay(const ShowTo& show, const std::string& source, bool with_lines,
             const std::function<YAML::Node()>& read, std::vector<std::string>& problems) {
  try {
    YamlLoader loader(source, with_lines, read());
    show(loader);
    const std::vector<std::string> found = loader.finish();
    problems.insert(problems.end(), found.begin(), found.end());
  } catch (const YAML::BadFile&) {
    problems.push_back(source + ": cannot be read");
  } catch (const YAML::Exception& error) {
    const std::string line = with_lines ? ":" + std::to_string(error.mark.line + 1) : "";
    problems.push_back(source + line + ": not valid YAML: " + error.msg);
  } catch (const InputError& error) {
    problems.push_back(source + ": " + error.what());
  }
}

}  // namespace

void load(const ShowTo& show, const std::vector<std::filesystem::path>& files,
          const std::vector<std::string>& overrides, const std::string& option) {
  std::vector<std::string> problems;
  for (const std::filesystem::path& file : files) {
    overlay(
        show, file.string(), true, [&] { return read_file(file); }, problems);
  }
  for (const std::string& text : overrides) {
    overlay(
        show, option + " " + text, false, [&] { return parse_override(text); }, problems);
  }
  if (problems.empty()) {  // rules need values that are valid one by one
    ParameterCheck rules;
    show(rules);
    problems = rules.problems();
  }
  if (problems.empty()) return;
  if (problems.size() == 1) throw InputError(problems.front());
  throw InputError("configuration has " + std::to_string(problems.size()) + " errors:\n  " +
                   join(problems, "\n  "));
}

}  // namespace pocd::config_detail

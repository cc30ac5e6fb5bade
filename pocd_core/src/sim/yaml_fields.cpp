#include "yaml_fields.hpp"

#include <cmath>

#include "../common/parameter_text.hpp"
#include "pocd/common/check.hpp"

namespace pocd {
namespace {

YAML::Node lookup(const YAML::Node& map, const std::string& key) {
  // A const node does not create the key; an undefined one is not a map at all.
  return map.IsDefined() && map.IsMap() ? map[key] : YAML::Node(YAML::NodeType::Undefined);
}

template <class T>
T convert(const YAML::Node& node, const std::string& where, const char* what) {
  try {
    return node.as<T>();
  } catch (const YAML::Exception&) {
    throw InputError(where + " must be " + what);
  }
}

}  // namespace

YAML::Node load_yaml_file(const std::filesystem::path& file) {
  try {
    return YAML::LoadFile(file.string());
  } catch (const YAML::BadFile&) {
    throw InputError(file.string() + ": cannot be read");
  } catch (const YAML::Exception& error) {
    throw InputError(file.string() + ":" + std::to_string(error.mark.line + 1) + ": " + error.msg);
  }
}

YamlFields::YamlFields(YAML::Node map, std::string where, YAML::Node fallback)
    : map_(map), fallback_(fallback), where_(std::move(where)) {
  if (!map_.IsDefined() || !map_.IsMap()) throw InputError(where_ + ": must be a map of keys");
}

bool YamlFields::has(const std::string& key) const {
  const YAML::Node &map = map_, &fallback = fallback_;
  return lookup(map, key).IsDefined() || lookup(fallback, key).IsDefined();
}

YAML::Node YamlFields::node(const std::string& key) {
  known_.insert(key);
  const YAML::Node own = lookup(map_, key);
  if (own.IsDefined()) return own;
  const YAML::Node shared = lookup(fallback_, key);
  if (!shared.IsDefined()) fail(key, "is missing");
  return shared;
}

double YamlFields::number(const std::string& key) {
  const double value = convert<double>(node(key), where_ + ": key '" + key + "'", "a number");
  if (!std::isfinite(value)) fail(key, "must be finite");
  return value;
}

int YamlFields::integer(const std::string& key) {
  return convert<int>(node(key), where_ + ": key '" + key + "'", "an integer");
}

bool YamlFields::boolean(const std::string& key, bool otherwise) {
  if (!has(key)) return otherwise;
  return convert<bool>(node(key), where_ + ": key '" + key + "'", "true or false");
}

std::string YamlFields::text(const std::string& key) {
  return convert<std::string>(node(key), where_ + ": key '" + key + "'", "text");
}

Eigen::VectorXd YamlFields::numbers(const std::string& key, int count) {
  return number_list(node(key), count, where_ + ": key '" + key + "'");
}

void YamlFields::finish() const {
  std::string unknown;
  for (const YAML::Node& map : {map_, fallback_}) {
    if (!map.IsDefined() || !map.IsMap()) continue;
    for (const auto& entry : map) {
      const std::string key = convert<std::string>(entry.first, where_ + ": a key", "text");
      if (!known_.count(key)) unknown += (unknown.empty() ? "'" : ", '") + key + "'";
    }
  }
  if (!unknown.empty()) throw InputError(where_ + ": unknown key " + unknown);
}

void YamlFields::fail(const std::string& key, const std::string& what) const {
  throw InputError(where_ + ": key '" + key + "' " + what);
}

void YamlFields::no_choice(const std::string& key, const std::string& word,
                           const std::vector<std::string>& choices) const {
  fail(key, config_detail::not_one_of(word, choices));
}

Eigen::VectorXd number_list(const YAML::Node& node, int count, const std::string& where) {
  const std::string what = "a list of " + std::to_string(count) + " numbers";
  if (!node.IsSequence() || static_cast<int>(node.size()) != count) {
    throw InputError(where + " must be " + what);
  }
  Eigen::VectorXd out(count);
  for (int i = 0; i < count; ++i) {
    out[i] = convert<double>(node[i], where, what.c_str());
    if (!std::isfinite(out[i])) throw InputError(where + " must be " + what);
  }
  return out;
}

}  // namespace pocd

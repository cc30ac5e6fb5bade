#include "pocd/common/check_parameters.hpp"

#include <algorithm>

#include "parameter_text.hpp"
#include "pocd/common/check.hpp"

namespace pocd {

using config_detail::join;

void ParameterCheck::real(const char* name, double& value, const Range& range, const char* doc) {
  number(name, value, range, doc);
}
void ParameterCheck::integer(const char* name, int& value, const Range& range, const char* doc) {
  number(name, value, range, doc);
}
void ParameterCheck::natural(const char* name, std::uint64_t& value, const Range& range,
                             const char* doc) {
  number(name, static_cast<double>(value), range, doc);
}

void ParameterCheck::choice(const char* name, std::string& word,
                            const std::vector<std::string>& choices, const char*) {
  if (std::find(choices.begin(), choices.end(), word) != choices.end()) return;
  report(name, config_detail::not_one_of(word, choices));
}

void ParameterCheck::items(const char* name, ItemList& list, const char*) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    path_.push_back(std::string(name) + "[" + std::to_string(i) + "]");
    list.describe_item(i, *this);
    path_.pop_back();
  }
}

void ParameterCheck::begin_group(const char* name, const char*) { path_.push_back(name); }
void ParameterCheck::end_group() { path_.pop_back(); }
void ParameterCheck::inconsistent(const std::string& problem) { report("", problem); }

void ParameterCheck::require_none(const std::string& what) const {
  if (!problems_.empty()) throw InputError(what + ": " + join(problems_, "; "));
}

void ParameterCheck::number(const char* name, double value, const Range& range, const char* doc) {
  if (value >= range.low && value <= range.high) return;  // false for NaN
  report(name, config_detail::number_text(value) + " is out of range, allowed are " +
                   config_detail::range_text(range, doc));
}

void ParameterCheck::report(const std::string& name, const std::string& problem) {
  std::string field = join(path_, ".");
  if (!name.empty()) field += (field.empty() ? "" : ".") + name;
  problems_.push_back((field.empty() ? "" : field + ": ") + problem);
}

}  // namespace pocd

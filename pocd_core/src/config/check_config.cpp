#include "pocd/config/check_config.hpp"

#include <algorithm>

#include "parameter_text.hpp"
#include "pocd/common/check.hpp"

namespace pocd::config_detail {
namespace {

class Check final : public ParameterSink {
 public:
  void real(const char* name, double& value, const Range& range, const char* doc) override {
    number(name, value, number_text(value), range, doc);
  }
  void integer(const char* name, int& value, const Range& range, const char* doc) override {
    number(name, value, std::to_string(value), range, doc);
  }
  void natural(const char* name, std::uint64_t& value, const Range& range,
               const char* doc) override {
    number(name, static_cast<double>(value), std::to_string(value), range, doc);
  }
  void boolean(const char*, bool&, const char*) override {}
  void text(const char*, std::string&, const char*) override {}
  void choice(const char* name, std::string& value, const Choices& choices, const char*) override {
    if (std::find(choices.words.begin(), choices.words.end(), value) != choices.words.end()) return;
    report(name, "\"" + value + "\" is not one of: " + join(choices.words, ", "));
  }
  void texts(const char*, std::vector<std::string>&, const char*) override {}
  void items(const char* name, ItemList& list, const char*) override {
    for (std::size_t i = 0; i < list.size(); ++i) {
      path_.push_back(std::string(name) + "[" + std::to_string(i) + "]");
      list.describe_item(i, *this);
      path_.pop_back();
    }
  }
  void begin_group(const char* name, const char*) override { path_.push_back(name); }
  void end_group() override { path_.pop_back(); }
  void inconsistent(const std::string& problem) override {
    problems.push_back((path_.empty() ? "" : join(path_, ".") + ": ") + problem);
  }

  std::vector<std::string> problems;

 private:
  void number(const char* name, double value, const std::string& text, const Range& range,
              const char* doc) {
    if (value >= range.low && value <= range.high) return;  // false for NaN
    report(name, text + " is not in " + range_text(range, doc));
  }
  void report(const char* name, const std::string& problem) {
    path_.push_back(name);
    problems.push_back(join(path_, ".") + ": " + problem);
    path_.pop_back();
  }

  std::vector<std::string> path_;
};

}  // namespace

std::vector<std::string> problems_of(const ShowTo& show) {
  Check check;
  show(check);
  return check.problems;
}

void throw_problems(const std::vector<std::string>& problems, const std::string& source) {
  if (problems.empty()) return;
  const std::string start = source.empty() ? "" : source + ": ";
  if (problems.size() == 1) throw InputError(start + problems.front());
  throw InputError(start + "configuration has " + std::to_string(problems.size()) +
                   " errors:\n  " + join(problems, "\n  "));
}

}  // namespace pocd::config_detail

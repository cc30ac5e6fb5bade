// Whether the values of a configuration are allowed, wherever they come from: files are checked by
// their loader, values that C++ code has set by the class that takes them.
#pragma once

#include <string>
#include <vector>

#include "pocd/common/parameter_sink.hpp"

namespace pocd {

/// Collects what show_parameters() finds wrong: values outside their range, numbers that are no
/// value of their enum, broken rules between fields. Changes nothing.
class ParameterCheck final : public ParameterSink {
 public:
  void real(const char* name, double& value, const Range& range, const char* doc) override;
  void integer(const char* name, int& value, const Range& range, const char* doc) override;
  void natural(const char* name, std::uint64_t& value, const Range& range,
               const char* doc) override;
  void boolean(const char*, bool&, const char*) override {}
  void text(const char*, std::string&, const char*) override {}
  void choice(const char* name, std::string& word, const std::vector<std::string>& choices,
              const char* doc) override;
  void texts(const char*, std::vector<std::string>&, const char*) override {}
  void items(const char* name, ItemList& list, const char* doc) override;
  void begin_group(const char* name, const char* doc) override;
  void end_group() override;
  void inconsistent(const std::string& problem) override;

  /// One line each, "change.tau_m: 0 is out of range, allowed are 0.001 to 10 m".
  const std::vector<std::string>& problems() const { return problems_; }
  /// Throws InputError with all problems in one line, after `what`; does nothing without any.
  void require_none(const std::string& what) const;

 private:
  void number(const char* name, double value, const Range& range, const char* doc);
  void report(const std::string& name, const std::string& problem);

  std::vector<std::string> path_;
  std::vector<std::string> problems_;
};

/// Throws InputError that names each wrong field of `config`, its value and what is allowed.
template <class T>
void check_parameters(T config, const std::string& what) {
  ParameterCheck check;
  show_parameters(config, check);
  check.require_none(what);
}

}  // namespace pocd

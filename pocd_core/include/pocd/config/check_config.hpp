// Whether the values of a configuration are allowed, whoever made it: a file or C++.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pocd/config/parameter_sink.hpp"

namespace pocd {

namespace config_detail {

using ShowTo = std::function<void(ParameterSink&)>;
/// One line per problem.
std::vector<std::string> problems_of(const ShowTo& show);
/// Nothing, or one InputError that lists all of `problems`; `source` begins it.
void throw_problems(const std::vector<std::string>& problems, const std::string& source);

}  // namespace config_detail

/// Throws one InputError, beginning with `source`, that lists everything wrong: numbers out of range
/// or not finite, words that are none of the choices, broken rules between parameters.
template <class T>
void check_config(T config, const std::string& source) {
  config_detail::throw_problems(
      config_detail::problems_of([&](ParameterSink& sink) { show_parameters(config, sink); }),
      source);
}

}  // namespace pocd

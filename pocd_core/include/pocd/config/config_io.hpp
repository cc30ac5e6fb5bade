// Configuration files: strict load, dump and the parameter page, for every struct with describe().
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pocd/common/parameter_sink.hpp"

namespace pocd {

namespace config_detail {

using ShowTo = std::function<void(ParameterSink&)>;
void load(const ShowTo& show, const std::vector<std::filesystem::path>& files,
          const std::vector<std::string>& overrides, const std::string& option);
std::string dump(const ShowTo& show);
std::string markdown(const ShowTo& show);

}  // namespace config_detail

/// Reads YAML files in order over the values that `config` has; a later file overrides an earlier
/// one key by key, and a list replaces the whole earlier list. Then `overrides`, each
/// "group.key=value", given by the command line's `option`, which errors name.
///
/// Throws one InputError that lists everything wrong, one line each with file and line: unknown
/// keys (with the likely intended one), duplicate keys, wrong types, values out of range or not
/// among the choices, broken rules between parameters, unreadable files. `config` is then
/// unspecified.
template <class T>
void load_config(T& config, const std::vector<std::filesystem::path>& files,
                 const std::vector<std::string>& overrides = {},
                 const std::string& option = "--set") {
  config_detail::load([&](ParameterSink& sink) { show_parameters(config, sink); }, files, overrides,
                      option);
}

/// YAML text of every value; load_config of it gives the same values bit by bit.
template <class T>
std::string dump_config(T config) {
  return config_detail::dump([&](ParameterSink& sink) { show_parameters(config, sink); });
}

/// Markdown tables of every parameter: name, value in `config` as its default, range, meaning.
template <class T>
std::string parameters_markdown(T config = T{}) {
  return config_detail::markdown([&](ParameterSink& sink) { show_parameters(config, sink); });
}

}  // namespace pocd

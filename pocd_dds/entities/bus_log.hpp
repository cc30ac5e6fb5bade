// Messages of readers, writers and participants, to whoever the process has named.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "pocd_dds/bus_log.hpp"

namespace pocd::dds {

/// Thread-safe; throws nothing. What is said within the function given to set_bus_log goes to
/// stderr.
void log(LogLevel level, const std::string& text) noexcept;

/// This thread is within the function given to set_bus_log.
bool within_bus_log();
/// To stderr, whatever was given to set_bus_log.
void log_to_stderr_only(LogLevel level, const std::string& text);

template <class... Values>
void log_warning(fmt::format_string<Values...> text, Values&&... values) {
  log(LogLevel::kWarning, fmt::format(text, std::forward<Values>(values)...));
}
template <class... Values>
void log_error(fmt::format_string<Values...> text, Values&&... values) {
  log(LogLevel::kError, fmt::format(text, std::forward<Values>(values)...));
}

}  // namespace pocd::dds

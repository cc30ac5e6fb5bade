// What programs on the bus say on stderr: how much, and in which form.
#pragma once

#include <spdlog/formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>

#include "pocd_dds/bus_log.hpp"

namespace pocd::dds {

struct LogOptions {
  std::string level = "info";
  bool json = false;
};
/// Of this process, as its command line says.
inline LogOptions log_options;

/// Text as the value of a JSON string (RFC 8259, 7). Bytes from 0x80 on stay as they are.
inline std::string json_text(const char* begin, const char* end) {
  std::string text;
  for (const char* c = begin; c != end; ++c) {
    const auto byte = static_cast<unsigned char>(*c);
    if (*c == '"' || *c == '\\') {
      text += {'\\', *c};
    } else if (byte < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", byte);
      text += code;
    } else {
      text += *c;
    }
  }
  return text;
}

/// A line per message: {"time":"2025-01-31T12:00:00.123Z","level":"warning",...}.
class JsonLines : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& to) override {
    const auto since = message.time.time_since_epoch();
    const std::time_t second = std::chrono::duration_cast<std::chrono::seconds>(since).count();
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(since).count() % 1000;
    std::tm utc{};
    gmtime_r(&second, &utc);
    char time[40];
    std::strftime(time, sizeof time, "%Y-%m-%dT%H:%M:%S", &utc);
    const auto level = spdlog::level::to_string_view(message.level);
    const auto& name = message.logger_name;
    const auto& payload = message.payload;
    const std::string line = fmt::format(
        "{{\"time\":\"{}.{:03}Z\",\"level\":\"{}\",\"program\":\"{}\",\"message\":\"{}\"}}\n", time,
        ms, std::string(level.data(), level.size()),
        json_text(name.data(), name.data() + name.size()),
        json_text(payload.data(), payload.data() + payload.size()));
    to.append(line.data(), line.data() + line.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonLines>();
  }
};

/// Adds --log-level and --log-json.
inline void add_log_options(CLI::App& app) {
  app.add_option("--log-level", log_options.level, "Least of what is said on stderr")
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  app.add_flag("--log-json", log_options.json, "Say it as one JSON object per line");
}

/// Messages, of the libraries and of Fast DDS, too, go to stderr; stdout belongs to results.
inline void log_to_stderr(const std::string& program) {
  auto logger = spdlog::stderr_color_mt(program);
  if (log_options.json) {
    logger->set_formatter(std::make_unique<JsonLines>());
  } else {
    logger->set_pattern("[%H:%M:%S.%e] %n: %^%l%$: %v");
  }
  spdlog::set_default_logger(logger);
  spdlog::set_level(spdlog::level::from_str(log_options.level));
  set_bus_log([logger](LogLevel level, const std::string& text) {
    logger->log(level == LogLevel::kInfo      ? spdlog::level::info
                : level == LogLevel::kWarning ? spdlog::level::warn
                                              : spdlog::level::err,
                text);
  });
}

}  // namespace pocd::dds

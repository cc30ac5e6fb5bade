// The installed commands as processes on a domain of their own.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "run_command.hpp"
#include "test_domain.hpp"

namespace pocd {

/// A domain of its own for this process and its children, until it ends.
inline std::string test_domain() {
  static const TestDomain domain;
  static const std::string text = [] {
    ::setenv("ROS_DOMAIN_ID", domain.text().c_str(), 1);
    ::setenv("SKIP_DEFAULT_XML", "1", 1);
    return domain.text();
  }();
  return text;
}

inline std::string command(const std::string& name) {
  test_domain();
  return std::string(POCD_BIN_DIR) + "/" + name;
}

/// Waits until the process says so on stderr; false after a time that only a hang needs.
inline bool says(const Process& process, const std::string& text) {
  for (int i = 0; i < 1200; ++i) {
    if (process.err().find(text) != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  ADD_FAILURE() << "never said \"" << text << "\", but:\n" << process.err();
  return false;
}

/// Asks it to end in order, and expects exit code 0.
inline CommandResult stop(Process& process) {
  process.signal(SIGTERM);
  CommandResult result = process.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result;
}

}  // namespace pocd

// What the commands on the bus have in common: signals, logging, bus options.
#pragma once

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <exception>
#include <iostream>
#include <string>

#include "apps/logging.hpp"
#include "pocd/common/check.hpp"
#include "pocd_dds/entities/participant.hpp"

namespace pocd::dds {

inline std::atomic<bool> stop_requested{false};

/// The first SIGINT, SIGTERM or SIGHUP (its terminal was closed) asks for an orderly end; the next
/// SIGINT or SIGTERM ends the process. Who started it with nohup goes on.
inline void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) {
    stop_requested = true;
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
  };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

/// Adds --domain, --profiles and --security, and the options of the log.
inline void add_bus_options(CLI::App& app, int& domain, std::string& profiles_file,
                            std::string& security_folder) {
  app.add_option("--domain", domain, "DDS domain; default: ROS_DOMAIN_ID, or 0")
      ->check(CLI::Range(0, 232));
  app.add_option("--profiles", profiles_file,
                 "Fast DDS XML profiles: a default participant profile, or profiles named like a "
                 "topic, replace the built-in settings")
      ->check(CLI::ExistingFile);
  app.add_option("--security", security_folder,
                 "Folder with identity and permissions (docs/security.md): talk to nobody without")
      ->envname("POCD_SECURITY")
      ->check(CLI::ExistingDirectory);
  add_log_options(app);
}

/// Runs `body`; an exception becomes one line on stderr and exit code 1.
template <class Body>
int guarded(const char* program, Body body) {
  try {
    return body();
  } catch (const std::exception& error) {
    std::cerr << program << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace pocd::dds

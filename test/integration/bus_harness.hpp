// What tests on the bus share: a domain of their own, waiting for a state, the commands.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "pocd_dds/entities/reader.hpp"
#include "pocd_msgsPubSubTypes.h"
#include "run_command.hpp"
#include "test_domain.hpp"

namespace pocd {

// Far more than anything takes; only a test that fails gets there.
constexpr std::chrono::seconds kGenerous{120};

/// Waits until the state is there. False: it never came.
inline bool eventually(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + kGenerous;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

/// How often a process said it.
inline std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

inline std::string bin(const std::string& name) { return std::string(POCD_BIN_DIR) + "/" + name; }
inline std::string source(const std::string& path) {
  return std::string(POCD_SOURCE_DIR) + "/" + path;
}
inline std::string scenario() { return source("test/integration/data/two_drives.yaml"); }

/// pocd_node for robot1 with the simulator's classes.
inline std::vector<std::string> node_command(const TestDomain& domain,
                                             const std::vector<std::string>& more = {}) {
  std::vector<std::string> command{bin("pocd_node"), "--config", source("config/simulated.yaml"),
                                   "--robot",        "robot1",   "--domain",
                                   domain.text()};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

/// pocd_play of a scenario, every frame acknowledged.
inline std::vector<std::string> play_command(const TestDomain& domain,
                                             const std::vector<std::string>& more = {},
                                             const std::string& input = scenario()) {
  std::vector<std::string> command{bin("pocd_play"), "--dataset",  "sim",      "--input",    input,
                                   "--fast",         "--lossless", "--domain", domain.text()};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

/// The newest health of the node on a domain.
class HealthWatch {
 public:
  explicit HealthWatch(const std::shared_ptr<dds::Participant>& participant)
      : reader_(participant, dds::topics::kHealth, wakeup_) {}

  /// Null as long as no node was heard.
  const pocd_msgs::msg::NodeHealth* newest() {
    pocd_msgs::msg::NodeHealth message;
    dds::SampleMeta meta;
    while (reader_.take(message, meta)) {
      if (!meta.valid) continue;
      newest_ = message;
      heard_ = true;
    }
    return heard_ ? &newest_ : nullptr;
  }
  std::uint64_t problem(const std::string& topic, const std::string& reason) {
    if (newest() == nullptr) return 0;
    for (const auto& entry : newest_.problems()) {
      if (entry.topic() == topic && entry.reason() == reason) return entry.count();
    }
    return 0;
  }

 private:
  dds::Wakeup wakeup_;
  dds::Reader<pocd_msgs::msg::NodeHealthPubSubType> reader_;
  pocd_msgs::msg::NodeHealth newest_;
  bool heard_ = false;
};

inline std::shared_ptr<dds::Participant> test_participant(const TestDomain& domain) {
  return std::make_shared<dds::Participant>(dds::BusOptions{domain.number(), "", "pocd_test"});
}

}  // namespace pocd

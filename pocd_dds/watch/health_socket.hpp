// How a node is, by a socket of its machine: asking takes a millisecond and no participant.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace pocd::dds {

/// What is asked for.
struct HealthWord {
  std::string name;    ///< of the node
  std::string line;    ///< how it is, for people
  bool good = false;   ///< level below 2
  bool ready = false;  ///< it takes frames and publishes
  double age_s = 0.0;  ///< since the node said so; set by the socket
};

/// The node's side: whoever connects gets the newest word as one JSON object, and nothing is read.
class HealthSocket {
 public:
  /// Listens on a path, which users of the machine may open as the folder lets them; a socket that
  /// a killed process left there is replaced. Throws InputError naming it when it cannot be had.
  explicit HealthSocket(const std::filesystem::path& path);
  /// Takes the path away.
  ~HealthSocket();
  HealthSocket(const HealthSocket&) = delete;
  HealthSocket& operator=(const HealthSocket&) = delete;

  /// Thread-safe.
  void update(const HealthWord& word);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Asks once, for at most `timeout_s`. Without a value: nobody is there, or says nothing of use.
std::optional<HealthWord> ask_health(const std::filesystem::path& path, double timeout_s);

}  // namespace pocd::dds

// A recording back onto the bus.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pocd_dds/entities/participant.hpp"
#include "pocd_dds/recording/recorded_topic.hpp"

namespace pocd::dds {

struct ReplayOptions {
  BusOptions bus;
  std::vector<std::filesystem::path> inputs;  ///< files or folders, one after the other
  std::vector<std::string> topics;            ///< patterns; empty: all
  /// Patterns of topics that are played latched (transient local), or not, whatever was recorded.
  std::vector<std::string> latch, no_latch;
  std::map<std::string, std::string> remap;  ///< recorded name -> name, both as recorded
  /// Multiple of the original speed; nothing: as fast as possible.
  std::optional<double> speed = 1.0;
  /// Every reader has a sample before the next one of its topic is sent; best effort topics become
  /// reliable for that.
  bool lossless = false;
  double start_s = 0.0;              ///< after the first message
  std::optional<double> duration_s;  ///< of the recording; nothing: to the end
  bool loop = false;
  bool clock = false;  ///< publish rt/clock with the log time
  /// Patterns of topics whose readers are waited for; empty: the depth images, or without any in
  /// the recording one reader of any topic.
  std::vector<std::string> wait_for;
  int readers = 1;  ///< that each of them needs
  bool wait_for_readers = true;
  bool keyboard = false;  ///< the space key on stdin pauses and goes on
};

struct ReplayResult {
  std::uint64_t messages = 0, instance_changes = 0;
  std::uint64_t failures = 0;  ///< writes that Fast DDS refused
  std::uint64_t problems = 0;  ///< of the recording
  bool acknowledged = true;
  bool stopped = false;
};

class Replayer {
 public:
  /// Throws InputError: unreadable recordings, none of the topics in them, no bus.
  explicit Replayer(const ReplayOptions& options);
  ~Replayer();

  /// Waits for readers, sends everything at its time, waits until it is acknowledged. Ends early
  /// when `stop` becomes true.
  ReplayResult run(const std::atomic<bool>& stop);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::dds

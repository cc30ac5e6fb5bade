// The bus into a recording.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>

#include "pocd/recording/split_writer.hpp"
#include "pocd_dds/entities/participant.hpp"
#include "pocd_dds/recording/recorded_topic.hpp"

namespace pocd::dds {

struct RecorderOptions {
  BusOptions bus;
  std::filesystem::path output;
  std::vector<std::string> topics{"*"};  ///< patterns, see topic_matches
  std::vector<std::string> exclude;
  recording::SplitOptions split;
  bool overwrite = false;
  bool rerun = false;                    ///< also what Rerun's viewer takes, see RerunForm
  std::size_t queue_bytes = 512u << 20;  ///< received and not written yet; beyond it samples drop
  double flush_period_s = 1.0;           ///< what is older has reached the file
};

struct RecorderStatus {
  std::uint64_t messages = 0, bytes = 0;  ///< received, bytes of payload
  std::uint64_t file_bytes = 0;           ///< in all files
  std::uint64_t dropped = 0;              ///< received, but the disk was too slow
  std::uint64_t lost = 0;                 ///< not received, as the bus says
  std::size_t topics = 0, files = 0;
  std::size_t waiting_bytes = 0;
  /// What of markers is not in the form for Rerun, as "TOPIC: what", and how often.
  std::map<std::string, std::uint64_t> left_out_for_rerun;
};

/// Follows discovery: every topic that appears and matches is recorded, whatever its type.
/// Receiving happens on the middleware's threads, compression and writing on a thread of its own.
class Recorder {
 public:
  /// Throws InputError when the bus or the file cannot be used.
  explicit Recorder(const RecorderOptions& options);
  ~Recorder();

  /// Makes readers of what has been announced, for at most `time`. Throws InputError when the file
  /// cannot be written any more; the file is closed then.
  void step(std::chrono::milliseconds time);
  /// Stops listening, writes what is queued, and closes the file; throws like step().
  void stop();
  RecorderStatus status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::dds

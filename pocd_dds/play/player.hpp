// A data set on the bus, as robots with cameras would send it.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "pocd/config/node_config.hpp"
#include "pocd/input/dataset_reader.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "rosgraph_msgsPubSubTypes.h"

namespace pocd::dds {

struct PlayOptions {
  BusOptions bus;
  TopicPatterns topics;
  std::string robot = "robot1";  ///< name of the robot of sources that name none
  std::string map_frame = "map";
  /// Frames leave at this multiple of their own speed; nothing: as fast as they can be made (and
  /// are acknowledged).
  std::optional<double> speed = 1.0;
  bool lossless = false;  ///< every frame is acknowledged before the next one is sent
  bool clock = false;     ///< publish rt/clock
  bool wait_for_readers = true;
  std::optional<std::uint64_t> max_frames;
};

struct PlayResult {
  std::uint64_t frames = 0;
  std::uint64_t skipped = 0;
  bool acknowledged = true;  ///< reliable readers have everything
  bool stopped = false;
};

class Player {
 public:
  /// Plays what `reader` gives. Throws InputError when the bus cannot be used.
  Player(const PlayOptions& options, std::unique_ptr<DatasetReader> reader);
  ~Player();

  /// Waits for readers, sends all frames, waits until they are acknowledged. Ends early when `stop`
  /// becomes true.
  PlayResult run(const std::atomic<bool>& stop);

 private:
  class Robot;
  Robot& robot(const std::string& name, const Frame& first, const std::atomic<bool>& stop);

  PlayOptions options_;
  std::shared_ptr<Participant> participant_;
  std::unique_ptr<DatasetReader> reader_;
  std::map<std::string, std::unique_ptr<Robot>> robots_;
  std::unique_ptr<Writer<rosgraph_msgs::msg::ClockPubSubType>> clock_;
};

}  // namespace pocd::dds

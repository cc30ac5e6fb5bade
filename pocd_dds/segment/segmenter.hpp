// Colour images of the bus in, class masks out.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "pocd/config/node_config.hpp"
#include "pocd/input/input_topics.hpp"
#include "pocd/network/segmentation_network.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/entities/bus_watch.hpp"

namespace pocd::dds {

struct SegmenterOptions {
  BusOptions bus;
  /// Robots, and the topics of their colour images and masks; the rest is not looked at.
  InputConfig input;
  /// No image is dropped: the senders are held back. For replays.
  bool lossless = false;
};

struct SegmenterCounts {
  std::uint64_t images = 0;   ///< that came
  std::uint64_t masks = 0;    ///< that were sent
  std::uint64_t dropped = 0;  ///< a newer one of the robot came while the network was busy
  std::uint64_t refused = 0;  ///< no colour image, or one that the network failed on
  double busy_s = 0.0;        ///< time that the network took for the masks
};

/// One network for all robots: of each, the newest image waits, and robots take turns. A mask has
/// stamp, frame and size of its image.
class Segmenter {
 public:
  /// Throws InputError when the bus cannot be used or there can be no reader of a named robot.
  Segmenter(const SegmenterOptions& options, std::shared_ptr<SegmentationNetwork> network);
  ~Segmenter();
  Segmenter(const Segmenter&) = delete;
  Segmenter& operator=(const Segmenter&) = delete;

  /// Until `stop` becomes true. A thread takes images while the caller's runs the network.
  SegmenterCounts run(const std::atomic<bool>& stop);

 private:
  class Robot;

  bool is_ours(const ParticipantKey& participant) const;
  void take_until(const std::atomic<bool>& stop);
  void follow_bus();
  void meet(const RobotConfig& config, bool named);
  std::shared_ptr<Robot> next_with_image();
  void label(Robot& robot, const std::atomic<bool>& stop);

  const SegmenterOptions options_;
  const InputTopics topics_;
  const std::shared_ptr<SegmentationNetwork> network_;
  BusWatch watch_;
  // Images are read where they lie and written as messages: two forms of one type, of which a
  // participant has one.
  std::shared_ptr<Participant> participant_, masks_participant_;
  Wakeup taker_;   // something to be taken, or room for it
  Wakeup worker_;  // an image waits

  std::mutex mutex_;  // of what follows
  std::map<std::string, std::shared_ptr<Robot>> robots_;
  std::string last_;  // robot whose turn it was
  ProblemCounter problems_;
  SegmenterCounts counts_;
};

}  // namespace pocd::dds

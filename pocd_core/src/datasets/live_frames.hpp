// Which frames the component took while it was recorded: the topic pocd/frames (pocd_msgs
// FrameRecord).
#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "pocd/input/frame.hpp"

namespace pocd::recording {

/// One sample of the topic.
struct FrameRecord {
  StampNs stamp_ns = 0;
  std::string robot;
  std::uint64_t epoch = 0;
  std::uint64_t order = 0;   ///< 1, 2, ... of the frames processed; 0: dropped
  std::uint8_t outcome = 0;  ///< 0 processed, 1 dropped because the queue was full
  bool with_segmentation = false;
  bool with_color = false;
};

/// Throws DamagedData.
FrameRecord decode_frame_record(const std::uint8_t* data, std::size_t size);

/// Lets through what was processed, in that order and with the images that were there. For
/// the files of one recorded run.
class LiveFrames {
 public:
  /// Throws InputError when the files hold no such topic. With several epochs the first one counts.
  explicit LiveFrames(const std::vector<std::filesystem::path>& files);

  void add(Frame frame);
  /// The next frame in order, if it has been added.
  std::optional<Frame> take();
  /// The same when no more are added: passes over those that are missing.
  std::optional<Frame> take_last();
  /// Frames passed over because the recording does not give them.
  std::uint64_t missing() const { return missing_; }

 private:
  using Key = std::pair<std::string, StampNs>;
  std::deque<FrameRecord> order_;
  std::map<Key, bool> listed_;
  std::map<Key, Frame> waiting_;
  std::uint64_t missing_ = 0;
};

}  // namespace pocd::recording

// What a viewer asks of something that is played, and the time that it sees: the part
// playbackControl of the Foxglove WebSocket protocol (github.com/foxglove/foxglove-sdk,
// PlaybackControlRequest and PlaybackState).
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "pocd/common/types.hpp"

namespace pocd::view {

struct PlaybackRequest {
  bool play = false;  ///< false: pause
  float speed = 1.0F;
  std::optional<std::uint64_t> seek_ns;  ///< to this time first
  std::string id;                        ///< the answer has it, too
};

enum class PlaybackStatus : std::uint8_t { kPlaying = 0, kPaused = 1, kBuffering = 2, kEnded = 3 };

struct PlaybackState {
  PlaybackStatus status = PlaybackStatus::kPaused;
  StampNs time_ns = 0;
  float speed = 1.0F;
  bool did_seek = false;
  std::string request;  ///< id of the request that it answers, or empty
};

constexpr char kPlaybackRequestOpcode = 3;  ///< of a client's binary message
constexpr char kPlaybackStateOpcode = 5;    ///< of the server's
constexpr std::size_t kLongestPlaybackId = 256;

/// A client's binary message with its opcode. Nothing when it is none: too short, of another
/// opcode, an unknown command, an id that is too long.
std::optional<PlaybackRequest> playback_request_from(const std::string& message);
/// A binary message of the server.
std::string message_of(const PlaybackState& state);

/// The time that one viewer sees: it stands at the end until it is told otherwise. Playing at the
/// end begins at the start. Not thread-safe.
class PlaybackClock {
 public:
  using Wall = std::chrono::steady_clock::time_point;
  static constexpr float kSlowest = 0.001F, kFastest = 1000.0F;

  PlaybackClock(StampNs first_ns, StampNs last_ns);

  /// What it says of itself afterwards. A time outside of the range is the next one inside. False
  /// when the speed is none (not a number, 0, negative, above kFastest): nothing changes.
  bool apply(const PlaybackRequest& request, Wall now, PlaybackState& state);
  /// The state at that moment, as of now on: what was being played may have ended.
  PlaybackState state(Wall now);
  bool playing() const { return playing_; }
  StampNs first_ns() const { return first_ns_; }
  StampNs last_ns() const { return last_ns_; }

 private:
  StampNs first_ns_, last_ns_;
  StampNs from_ns_;  // shown at since_
  Wall since_{};
  float speed_ = 1.0F;
  bool playing_ = false;
};

}  // namespace pocd::view

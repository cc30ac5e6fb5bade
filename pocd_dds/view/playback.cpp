#include "view/playback.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace pocd::view {
namespace {

constexpr std::size_t kFixed = 1 + 1 + 4 + 1 + 8 + 4;  // bytes of a request without its id

std::uint64_t little_endian(const std::string& bytes, std::size_t at, int size) {
  std::uint64_t value = 0;
  for (int i = size - 1; i >= 0; --i)
    value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<char>(value >> (8 * i)));
}

}  // namespace

std::optional<PlaybackRequest> playback_request_from(const std::string& message) {
  if (message.size() < kFixed || message[0] != kPlaybackRequestOpcode) return std::nullopt;
  const auto command = static_cast<unsigned char>(message[1]);
  const std::uint64_t length = little_endian(message, kFixed - 4, 4);
  if (command > 1 || length > kLongestPlaybackId || message.size() - kFixed < length) {
    return std::nullopt;
  }
  PlaybackRequest request;
  request.play = command == 0;
  const auto bits = static_cast<std::uint32_t>(little_endian(message, 2, 4));
  static_assert(sizeof request.speed == sizeof bits);
  std::memcpy(&request.speed, &bits, sizeof bits);
  if (message[6] != 0) request.seek_ns = little_endian(message, 7, 8);
  request.id = message.substr(kFixed, length);
  return request;
}

std::string message_of(const PlaybackState& state) {
  std::string out(1, kPlaybackStateOpcode);
  put(out, static_cast<std::uint8_t>(state.status), 1);
  put(out, static_cast<std::uint64_t>(std::max<StampNs>(state.time_ns, 0)), 8);
  std::uint32_t bits = 0;
  std::memcpy(&bits, &state.speed, sizeof bits);
  put(out, bits, 4);
  put(out, state.did_seek ? 1 : 0, 1);
  put(out, state.request.size(), 4);
  return out + state.request;
}

PlaybackClock::PlaybackClock(StampNs first_ns, StampNs last_ns)
    : first_ns_(first_ns), last_ns_(std::max(first_ns, last_ns)), from_ns_(last_ns_) {}

PlaybackState PlaybackClock::state(Wall now) {
  PlaybackState state;
  state.speed = speed_;
  if (playing_) {
    const double gone_ns = std::chrono::duration<double, std::nano>(now - since_).count() * speed_;
    const bool ended = gone_ns >= static_cast<double>(last_ns_ - from_ns_);
    if (gone_ns > 0.0) from_ns_ = ended ? last_ns_ : from_ns_ + static_cast<StampNs>(gone_ns);
    since_ = now;
    playing_ = !ended;
  }
  state.time_ns = from_ns_;
  state.status = playing_               ? PlaybackStatus::kPlaying
                 : from_ns_ >= last_ns_ ? PlaybackStatus::kEnded
                                        : PlaybackStatus::kPaused;
  return state;
}

bool PlaybackClock::apply(const PlaybackRequest& request, Wall now, PlaybackState& answer) {
  const bool usable =
      std::isfinite(request.speed) && request.speed >= kSlowest && request.speed <= kFastest;
  answer = state(now);
  answer.request = request.id;
  if (!usable) return false;
  speed_ = request.speed;
  since_ = now;
  bool sought = false;
  if (request.seek_ns) {
    const auto wanted = static_cast<StampNs>(
        std::min<std::uint64_t>(*request.seek_ns, static_cast<std::uint64_t>(INT64_MAX)));
    from_ns_ = std::clamp(wanted, first_ns_, last_ns_);
    sought = true;
  } else if (request.play && !playing_ && from_ns_ >= last_ns_) {
    from_ns_ = first_ns_;
    sought = true;
  }
  playing_ = request.play && from_ns_ < last_ns_;
  answer = state(now);
  answer.request = request.id;
  answer.did_seek = sought;
  return true;
}

}  // namespace pocd::view

// What is said about something that may stand still. Without middleware and without a clock.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

namespace pocd::dds {

/// Says once that it stands still, and once that it goes on. One thread looks; the count is
/// thread-safe.
class StallNote {
 public:
  /// `what` begins the sentences, `advice` ends the first one. It hangs from `stall_s` on [s].
  StallNote(std::string what, std::string advice, double stall_s)
      : what_(std::move(what)), advice_(std::move(advice)), stall_s_(stall_s) {}

  struct Word {
    bool hangs = false;
    std::string text;
  };
  /// It has stood still for `still_s` [s], 0 when it does not. Without a value: nothing new.
  std::optional<Word> look(double still_s) {
    const bool hangs = still_s >= stall_s_;
    if (hangs) longest_s_ = still_s;
    if (hangs == hangs_) return std::nullopt;
    hangs_ = hangs;
    const std::string seconds = std::to_string(static_cast<long>(longest_s_)) + " s";
    if (!hangs) return Word{false, what_ + " goes on after more than " + seconds};
    ++stalls_;
    return Word{true, what_ + " has not ended a turn for " + seconds + ": " + advice_};
  }
  /// How often it has begun to hang.
  std::uint64_t stalls() const { return stalls_; }

 private:
  const std::string what_, advice_;
  const double stall_s_;
  double longest_s_ = 0.0;
  bool hangs_ = false;
  std::atomic<std::uint64_t> stalls_{0};
};

}  // namespace pocd::dds

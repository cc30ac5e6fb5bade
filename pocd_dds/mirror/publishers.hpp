// Whom a copy follows when several nodes say that they publish its map. Without middleware; time is
// an argument.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace pocd::dds {

/// One publisher is followed for as long as it claims the map: its writer of manifests is there,
/// was heard within kSilence, and has not ended its run. So a new run is taken over at once when
/// the one before has ended or was killed, and two that run side by side are never mixed. Not
/// thread-safe.
class Publishers {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Writer = std::array<std::uint8_t, 16>;
  /// Manifests come every second.
  static constexpr std::chrono::milliseconds kSilence{3000};
  static constexpr std::chrono::milliseconds kMeeting{1000};
  /// One that is there and says nothing for so long hangs, or is not heard.
  static constexpr std::chrono::seconds kQuiet{10};

  /// A manifest has come. True: it is of the one that is followed, perhaps from now on.
  bool heard(const Writer& writer, std::uint64_t epoch, bool final_version, Time now) {
    Claim& claim = claims_[writer];
    claim.epoch = epoch;
    claim.ended = final_version;
    claim.heard = now;
    if (followed_ != epoch && followed_ && claims(*followed_, now)) return false;
    followed_ = epoch;
    ended_ = final_version;
    heard_ = now;
    return true;
  }
  /// Forgets whose writer has gone; `present` says whether one is there. The bus may tell of a
  /// writer after its first sample: one that was never there is given some time.
  template <class Present>
  void forget_gone(const Present& present, Time now) {
    for (auto it = claims_.begin(); it != claims_.end();) {
      Claim& claim = it->second;
      const bool there = present(it->first);
      claim.met = claim.met || there;
      const bool gone = !there && (claim.met || now - claim.heard >= kMeeting);
      it = gone ? claims_.erase(it) : std::next(it);
    }
  }

  std::optional<std::uint64_t> followed() const { return followed_; }
  /// The writer of the one that is followed is there.
  bool present() const {
    for (const auto& [writer, claim] : claims_) {
      if (claim.epoch == followed_) return true;
    }
    return false;
  }
  /// For how long nothing has come of the one that is followed; zero when it has ended its run.
  std::chrono::steady_clock::duration silence(Time now) const {
    return followed_ && !ended_ ? now - heard_ : std::chrono::steady_clock::duration::zero();
  }
  /// Runs beside the one that is followed, which is there, too.
  std::vector<std::uint64_t> rivals(Time now) const {
    std::vector<std::uint64_t> epochs;
    if (!followed_ || !claims(*followed_, now)) return epochs;
    for (const auto& [writer, claim] : claims_) {
      if (claim.epoch != followed_ && claims(claim, now)) epochs.push_back(claim.epoch);
    }
    return epochs;
  }
  /// What comes from this run is another publisher's and not for the copy.
  bool foreign(std::uint64_t epoch, Time now) const {
    return epoch != followed_ && followed_ && claims(epoch, now) && claims(*followed_, now);
  }

 private:
  struct Claim {
    std::uint64_t epoch = 0;
    bool ended = false;
    Time heard{};
    bool met = false;  // its writer was there
  };
  static bool claims(const Claim& claim, Time now) {
    return !claim.ended && now - claim.heard < kSilence;
  }
  bool claims(std::uint64_t epoch, Time now) const {
    for (const auto& [writer, claim] : claims_) {
      if (claim.epoch == epoch && claims(claim, now)) return true;
    }
    return false;
  }

  std::map<Writer, Claim> claims_;
  std::optional<std::uint64_t> followed_;
  bool ended_ = false;  // the one that is followed
  Time heard_{};        // the same
};

}  // namespace pocd::dds

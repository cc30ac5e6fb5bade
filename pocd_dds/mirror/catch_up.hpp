// By what means a copy that is behind is repaired, and when. Without middleware; time is an
// argument.
#pragma once

#include <chrono>
#include <optional>

#include "pocd_dds/map_mirror.hpp"

namespace pocd::dds {

/// Not thread-safe.
class CatchUpPlan {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct State {
    bool stale = false;
    bool has_base = false;  ///< a part of the map would be enough
    bool can_ask = false;   ///< somebody hears requests for snapshots
  };
  struct Wish {
    bool gather = false;   ///< read the single tiles
    bool restart = false;  ///< from the beginning: what was read has led to nothing
    bool ask = false;      ///< send a request for a snapshot now
  };

  explicit CatchUpPlan(CatchUp means) : means_(means) {}

  /// Something has arrived that leads on.
  void progress(Time now) { moved_ = now; }

  Wish next(Time now, const State& state) {
    Wish wish;
    if (!state.stale) {
      moved_.reset(), asked_.reset(), gathering_.reset();
      return wish;
    }
    if (!moved_) moved_ = now;
    const auto still = now - *moved_;
    const bool stuck = still >= kGiveUp;
    // One who has nothing gets each tile once and for himself alone; one who lacks a step gets just
    // that by a snapshot.
    const bool snapshot_first = means_ == CatchUp::kSnapshot ||
                                (means_ == CatchUp::kEither && state.has_base && state.can_ask);
    const bool may_ask = means_ != CatchUp::kTiles && (snapshot_first || stuck);
    const bool may_gather = means_ != CatchUp::kSnapshot && (!snapshot_first || stuck);
    if (may_ask && state.can_ask && still >= kPatience && (!asked_ || now - *asked_ >= kGiveUp)) {
      asked_ = now;
      wish.ask = true;
    }
    if (gathering_ || (may_gather && still >= kPatience)) {
      wish.gather = true;
      wish.restart = gathering_ && stuck && now - *gathering_ >= kStartOver;
      if (!gathering_ || wish.restart) gathering_ = now;
    }
    return wish;
  }

 private:
  // Deltas and manifest travel on different topics: what is behind for less than this is on its
  // way.
  static constexpr std::chrono::milliseconds kPatience{300};
  static constexpr std::chrono::milliseconds kGiveUp{2000};
  static constexpr std::chrono::milliseconds kStartOver{6000};

  CatchUp means_;
  std::optional<Time> moved_, asked_, gathering_;
};

}  // namespace pocd::dds

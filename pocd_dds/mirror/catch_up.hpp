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
    bool can_ask = false;  ///< somebody hears requests for snapshots
    bool hears = false;    ///< there is a reader of replies, and it has a writer
  };
  struct Wish {
    bool listen = false;   ///< have a reader of replies
    bool ask = false;      ///< send a request for a snapshot now
    bool gather = false;   ///< read the single tiles
    bool restart = false;  ///< from the beginning: what was read has led to nothing
  };

  explicit CatchUpPlan(CatchUp means) : means_(means) {}

  /// Something has arrived that leads on.
  void progress(Time now) { moved_ = now; }

  Wish next(Time now, const State& state) {
    Wish wish;
    if (!state.stale) {
      moved_.reset(), asked_.reset(), gathering_.reset(), heard_.reset();
      listening_ = false;
      return wish;
    }
    if (!moved_) moved_ = now;
    const auto still = now - *moved_;
    const bool stuck = still >= kGiveUp;
    // Snapshots leave at the rate of map data. Tiles that the bus keeps come all at once, and what
    // else the network carries waits behind them.
    const bool snapshot_first =
        means_ == CatchUp::kSnapshot || (means_ == CatchUp::kEither && state.can_ask);
    const bool may_ask = means_ != CatchUp::kTiles && (snapshot_first || stuck) && state.can_ask;
    const bool may_gather = means_ != CatchUp::kSnapshot && (!snapshot_first || stuck);
    // Only who lacks something listens: a reply goes to all who do.
    listening_ = listening_ || (may_ask && still >= kPatience);
    wish.listen = listening_;
    if (!state.hears) heard_.reset();
    if (state.hears && !heard_) heard_ = now;
    if (may_ask && heard_ && now - *heard_ >= kMatched && still >= kPatience &&
        (!asked_ || now - *asked_ >= kGiveUp)) {
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
  // The publisher hears of a reader a moment after the reader of the publisher.
  static constexpr std::chrono::milliseconds kMatched{100};
  static constexpr std::chrono::milliseconds kGiveUp{2000};
  static constexpr std::chrono::milliseconds kStartOver{6000};

  CatchUp means_;
  std::optional<Time> moved_, asked_, gathering_, heard_;
  bool listening_ = false;
};

}  // namespace pocd::dds

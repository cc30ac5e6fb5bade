// How well the events of a run tell what changed. docs/evaluation.md defines the matching.
#pragma once

#include <array>
#include <map>
#include <string>

#include "pocd/eval/scene_truth.hpp"
#include "pocd/objects/frame_result.hpp"

namespace pocd {

/// Events of one run, and what the library held when each visit began.
struct RunEvents {
  struct Timed {
    ObjectEvent event;
    std::size_t frame = 0;  ///< number within the run
  };
  std::vector<Timed> events;
  std::vector<std::vector<ObjectSnapshot>> objects_at_visit_begin;  ///< per visit
};

/// What the events of one visit say about one object in total.
struct NetChange {
  ChangeKind kind = ChangeKind::kAdded;
  ObjectId object = ObjectId::kNone;
  std::optional<OrientedBox> before, after;
  std::size_t frame = 0;  ///< of its last event
};

enum class NetVerdict {
  kRight,    ///< a true change of this kind, in this place
  kPartial,  ///< one half of a move, or a move where something was only removed or added
  kNeutral,  ///< says nothing false: discovery of a thing not seen before, repetition, superseded
  kFalse
};

struct ObjectScore {
  struct Found {
    SeenChange truth;
    bool exact = false;  ///< right kind and place
    bool place =
        false;  ///< old place known to be empty and new place to be taken, however reported
    std::optional<std::size_t> exact_frame;  ///< when the events first said so
  };
  std::vector<Found> changes;  ///< those that could be seen
  std::vector<std::pair<NetChange, NetVerdict>> nets;
  std::size_t unseen_changes = 0;  ///< true changes that no camera could see
  std::size_t false_changes = 0;   ///< REMOVED and MOVED nets that are false

  /// Of exact kinds; index by ChangeKind, or all of them. NaN when undefined.
  double precision(std::optional<ChangeKind> kind = std::nullopt) const;
  double recall(std::optional<ChangeKind> kind = std::nullopt) const;
  double f1(std::optional<ChangeKind> kind = std::nullopt) const;
  /// By places, whatever the kind.
  double place_f1() const;
  /// Frames from clear sight to the event, at least 0, of changes found exactly; sorted.
  std::vector<double> delays() const;
};

/// Sum of several scores.
ObjectScore merge(const std::vector<ObjectScore>& scores);

/// Net changes of one visit, by object; REMOVED followed by a MOVED from the same place is that
/// MOVED.
std::vector<NetChange> net_changes(const RunEvents& run, std::size_t first_frame,
                                   std::size_t end_frame);

ObjectScore score_objects(const RunEvents& run, const SceneTruth& truth);

}  // namespace pocd

// What the parts of ObjectTracker share while one frame is worked on.
#pragma once

#include <map>
#include <vector>

#include "object_tracker.hpp"

namespace pocd {

/// Count of a surfel that is known to be gone; one that is only seen through stays below.
constexpr std::uint8_t kLeftBehind = 255;

struct ObjectTracker::Step {
  const Frame& frame;
  const OrganizedCloud& cloud;
  const DepthField& field;
  const Observations& observations;
  const GroundModel& ground;
  TsdfMap& map;
  std::vector<std::uint32_t>& owner_of_observation;
  FrameResult& result;
  std::size_t candidate_count = 0;
  std::vector<ObjectId> in_view;
  AssociationResult association;
  /// Evidence of this frame's measurement, by object.
  std::map<ObjectId, Evidence> evidence;
  /// Observations that look like an object that has moved.
  std::map<std::int32_t, ObjectId> moved_from;
};

}  // namespace pocd

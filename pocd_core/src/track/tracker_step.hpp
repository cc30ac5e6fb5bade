// What the parts of ObjectTracker share while one frame is worked on.
#pragma once

#include <map>
#include <vector>

#include "object_tracker.hpp"

namespace pocd {

struct ObjectTracker::Step {
  const Frame& frame;
  const OrganizedCloud& cloud;
  const DepthField& field;
  const Observations& observations;
  const GroundModel& ground;
  TsdfMap& map;
  FrameResult& result;
  SightConfig sight;
  std::size_t look_count = 0;
  std::vector<Part> parts;
  /// Owner of each part; kNone while that is open.
  std::vector<ObjectId> owners;
  std::vector<Move> moves;  ///< of this frame
  /// Evidence of this frame's measurement, by object.
  std::map<ObjectId, Evidence> evidence;
};

}  // namespace pocd

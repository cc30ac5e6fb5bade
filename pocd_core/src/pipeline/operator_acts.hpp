// What an operator's word does to the parts of a pipeline.
#pragma once

#include "../track/object_tracker.hpp"
#include "ignored_regions.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/pipeline/operator_word.hpp"
#include "robot_notes.hpp"

namespace pocd {

struct WordParts {
  StampNs stamp_ns;  ///< of the newest frame
  ObjectTracker& tracker;
  TsdfMap& map;
  Grounds& grounds;
  IgnoredRegions& ignored;
};

WordOutcome follow(const OperatorWord& word, const WordParts& parts);

}  // namespace pocd

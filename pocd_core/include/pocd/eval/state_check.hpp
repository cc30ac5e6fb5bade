// Compares an object library with what stands on the table.
#pragma once

#include <functional>
#include <string>

#include "pocd/eval/state_truth.hpp"
#include "pocd/objects/frame_result.hpp"
#include "pocd/pipeline/pipeline_config.hpp"

namespace pocd {

struct StateMatch {
  std::size_t expected = 0;  ///< in ExpectedState::objects
  ObjectId object = ObjectId::kNone;
  double listed_m = 0.0;  ///< of the surface centroid to the nearest of the listed centres
  double box_m = 0.0;     ///< of the box centre to that of the box around the labelled points
};

struct StateVerdict {
  int state = 0;
  std::vector<StateMatch> matches;  ///< one to one, least total distance, by expected
  std::vector<std::size_t> missing;
  std::vector<ObjectId> kept_hidden;  ///< at the last place of a hidden thing
  std::vector<ObjectId> extra;
  /// Exactly the things that are there, centres within the tolerance of the listed ones.
  bool ok_listed = false;
  /// The same by the centres of boxes: the listed centre is that of the visible surface, which lies
  /// up to 6 cm from the centre of a box that is partly hidden.
  bool ok_box = false;
};

StateVerdict judge_state(const std::vector<ObjectSnapshot>& objects, const ExpectedState& expected,
                         double tolerance_m);

struct StateRun {
  std::vector<ExpectedState> expected;
  std::vector<StateVerdict> verdicts;
  std::vector<std::vector<ObjectSnapshot>> objects;  ///< after each state
  std::vector<std::vector<ObjectEvent>> events;      ///< during each state
};

/// Runs the pipeline over the folder, with or without its masks, and judges it after each state;
/// `done`, if given, is called then.
StateRun run_states(const StateTruth& truth, const std::filesystem::path& folder,
                    const PipelineConfig& config,
                    const std::function<void(const StateRun&)>& done = nullptr,
                    bool with_masks = true);

/// One line with the verdict, then one per object, expected thing and event.
std::string describe_last_state(const StateRun& run);

}  // namespace pocd

// Every parameter of the core, by stage. Defaults are those of the warehouse (TorWIC) setting.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pocd/belief/change_config.hpp"
#include "pocd/belief/state_config.hpp"
#include "pocd/common/describe.hpp"
#include "pocd/input/class_map.hpp"
#include "pocd/input/depth_noise.hpp"
#include "pocd/input/pose_gate.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/observe/association_config.hpp"
#include "pocd/observe/pose_refinement.hpp"
#include "pocd/segmentation/segmentation_config.hpp"

namespace pocd {

struct PipelineConfig {
  int threads = 1;
  DepthNoise depth_noise;
  PoseGateConfig pose_gate;
  PoseRefinementConfig pose_refinement;
  ClassMap classes;
  SegmentationConfig segmentation;
  AssociationConfig association;
  ChangeConfig change;
  StateConfig state;
  TsdfConfig map;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("threads", threads, Range{1, 64},
          "Threads of the pipeline; results do not depend on it.");
    visit.group("depth_noise", depth_noise, "Noise of the depth camera.");
    visit.group("pose_gate", pose_gate, "Refusing frames with impossible poses.");
    visit.group("pose_refinement", pose_refinement, "Correcting poses by what stands still.");
    visit.group("classes", classes, "Meaning of the segmentation's class indices.");
    visit.group("segmentation", segmentation, "From image to observations.");
    visit.group("association", association, "Which observation is which object.");
    visit.group("change", change, "Measuring geometric change.");
    visit.group("state", state, "Belief and life cycle of objects.");
    visit.group("map", map, "The TSDF map.");
  }
};

}  // namespace pocd

// Every parameter of the core, by stage. Defaults are those of the warehouse (TorWIC) setting.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pocd/association/association_config.hpp"
#include "pocd/change/change_config.hpp"
#include "pocd/config/describe.hpp"
#include "pocd/input/depth_noise.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/pipeline/pose_gate.hpp"
#include "pocd/pipeline/pose_refinement.hpp"
#include "pocd/input/class_map.hpp"
#include "pocd/segmentation/segmentation_config.hpp"
#include "pocd/state/state_config.hpp"

namespace pocd {

struct PipelineConfig {
  int threads = 1;
  double mask_timeout_s = 30.0;
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
    visit("mask_timeout_s", mask_timeout_s, Range{0.0, 1e6},
          "A robot that delivered segmentation images and delivers none for so long is mapped as one "
          "that never did: its pixels get classes.default_class. Until then its frames only show "
          "what is gone [s].");
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

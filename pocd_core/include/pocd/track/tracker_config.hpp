// What the tracking of objects needs of the configuration.
#pragma once

#include "pocd/belief/change_config.hpp"
#include "pocd/belief/state_config.hpp"
#include "pocd/input/class_map.hpp"
#include "pocd/input/depth_noise.hpp"
#include "pocd/map/tsdf_config.hpp"
#include "pocd/observe/association_config.hpp"
#include "pocd/segmentation/segmentation_config.hpp"

namespace pocd {

struct TrackerConfig {
  DepthNoise depth_noise;
  ClassMap classes;
  SegmentationConfig segmentation;
  AssociationConfig association;
  ChangeConfig change;
  StateConfig state;
  TsdfConfig map;
};

}  // namespace pocd

// The paper's method without any rule of ours: Qian, Chatrath, Yang, Servos, Schoellig, Waslander,
// "Probabilistic object-level change detection and volumetric mapping in semi-static scenes" (RSS
// 2022). What the pipeline is compared with as "published".
//
// The ways from a frame to clusters and from depth images to voxels are shared with the other
// methods. Where the paper is silent, the readings are:
// - |translation| of equation (1) is that of the object's centre: that of a transform in the map
//   frame would depend on the map's origin.
// - Where equation (2) has no voxel to sum over, the change is the translation that ICP found, with
//   the sign of equation (2).
// - A pixel of an observation that is discarded does not go into the map; background does.
// - A movable class of the role `dynamic` gives no observation, as for all methods.
#pragma once

#include <memory>

#include "pocd/eval/mapping_method.hpp"

namespace pocd {

/// Equation (1): lambda1 |translation| + lambda2 |rotation| + lambda3 [classes differ].
/// `translation_m`, `rotation_rad` >= 0.
double published_cost(double translation_m, double rotation_rad, bool same_class,
                      const PublishedConfig& config);

/// Observations whose boxes (heading by principal component analysis) overlap become one, with the
/// class of most of their pixels; boxes thinner than `min_size_m` count as that thick. All boxes
/// are then those of fit_box_pca.
void merge_overlapping_observations(double min_size_m, Observations& observations);

/// The whole method. Events: ADDED for a new object, REMOVED for an erased one; a moved object is
/// erased at its old place and added at its new one.
std::unique_ptr<MappingMethod> make_published_method(const PipelineConfig& config,
                                                     const PublishedConfig& own = {});

}  // namespace pocd

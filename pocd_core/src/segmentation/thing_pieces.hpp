// Things that are seen in pieces, told by geometry: where no instances say what is one thing.
#pragma once

#include <vector>

#include "clusters.hpp"

namespace pocd {

/// For each cluster the first one (itself, or one before it) that is a piece of the same thing.
/// Only clusters without an instance are looked at. Two pieces of one class are of one thing when
/// - something nearer hides what lies between them, and the surface of each goes on in the other's
///   plane, along at least half of the smaller one (a box behind a post); or
/// - one is seen over the upper edge of the other, which has no top though the camera looks down on
///   it, from end to end and up to the same height (the far wall of an open container).
std::vector<std::size_t> find_pieces(const OrganizedCloud& cloud, const SegmentationConfig& config,
                                     const DepthNoise& noise, double spacing_m,
                                     const PlaneSegmentation& planes,
                                     const std::vector<Cluster>& clusters);

}  // namespace pocd

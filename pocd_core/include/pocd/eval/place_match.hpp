// When a box of the library stands for a true thing. Most things are seen from one or two sides, so
// that the library's box is often a part of the true one, or just its face.
#pragma once

#include "pocd/common/types.hpp"

namespace pocd {

/// How far a mapped surface may lie outside the true one, pose error and depth noise together: two
/// voxels of the map. Boxes are compared with every size at least this: a face is a thin box.
constexpr double kPlaceTolerance_m = 0.1;

/// Volume of `box` within `truth` grown by the tolerance on every side, over the smaller volume of
/// the two.
double share_in_place(const OrientedBox& box, const OrientedBox& truth,
                      double tolerance_m = kPlaceTolerance_m);

/// True when at least half of the smaller volume is in place and the box covers at most four times
/// the true footprint: several things held as one object stand for each of them, the whole hall
/// does not.
bool same_place(const OrientedBox& box, const OrientedBox& truth,
                double tolerance_m = kPlaceTolerance_m);

/// True when the box holds at least half of the true thing's volume.
bool covers(const OrientedBox& box, const OrientedBox& truth,
            double tolerance_m = kPlaceTolerance_m);

/// How well a box and a true one agree: volume in place over the union of the two.
double place_fit(const OrientedBox& box, const OrientedBox& truth,
                 double tolerance_m = kPlaceTolerance_m);

}  // namespace pocd

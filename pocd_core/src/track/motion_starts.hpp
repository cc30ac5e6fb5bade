// Where a thing that departed may be one that was found: whether it can be, and from which motions
// an alignment starts.
#pragma once

#include <vector>

#include "pocd/common/types.hpp"
#include "pocd/objects/object_library.hpp"
#include "pocd/registration/icp_target.hpp"
#include "pocd/track/departures.hpp"

namespace pocd {

/// Whether what departed was seen in its place when `found` was there, too: then they are two
/// things. But a thing does not leave while it is looked at. When it is found gone on the visit on
/// which it was last in place (within `visit_gap_s` [s]), and the new thing stands partly in its
/// place (up to `slack_m` [m]), the first that was seen of the new one was taken for it, for a
/// second at most.
bool were_both_there(const Departure& departure, const LibraryObject& found, double visit_gap_s,
                     double slack_m);

/// Whether the found box stands as high as the known one, up to a quarter and `slack_m` [m].
bool stands_as_high(const OrientedBox& found, const OrientedBox& known, double slack_m);

/// Whether the found box is longer or higher than the known one by more than a quarter and
/// `slack_m` [m].
bool is_larger(const OrientedBox& found, const OrientedBox& known, double slack_m);

/// Motions from `found` to `known` that put their boxes' sides on each other, the likeliest ones
/// first: with the heading that it has and with the sides along each other; by the middles and by
/// the sides, since of each only a part may be known. `target`: the known surface; `source`: points
/// of the found one [m, W].
std::vector<Pose> likely_starts(const OrientedBox& known, const OrientedBox& found,
                                const IcpTarget& target, const Points& source);

}  // namespace pocd

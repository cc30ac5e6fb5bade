// Where a thing that departed may be one that was found: from which motions an alignment starts.
#pragma once

#include <vector>

#include "pocd/common/types.hpp"
#include "pocd/registration/icp_target.hpp"

namespace pocd {

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

// What has changed, drawn over the map from above.
#pragma once

#include <array>
#include <vector>

#include "birdseye_canvas.hpp"
#include "pocd/output/birdseye.hpp"

namespace pocd {

/// Corners of a box on the floor, in order around it [m].
std::array<Eigen::Vector2d, 4> floor_corners(const OrientedBox& box);

void draw_changes(const std::vector<BirdseyeChange>& changes, BirdseyeCanvas& canvas);

}  // namespace pocd

// The map from above as a picture: surfaces in grey, objects coloured by how stationary they are.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pocd/map/mesh.hpp"
#include "pocd/objects/frame_result.hpp"

namespace pocd {

/// Where an object was and where it is: both, it was moved; only one, it is gone or new.
struct BirdseyeChange {
  std::optional<OrientedBox> before, after;
};

struct BirdseyeOptions {
  int size_px = 1000;  ///< longer side of the picture, legend and axes included; at least 400
  std::string title = "Map from above";
  /// Heights that are drawn, relative to the ground; what is higher (ceilings, lamps) would hide
  /// the rest. Surfaces below ground_m count as ground and are drawn pale.
  double lowest_m = -0.5;
  double ground_m = 0.12;
  double highest_m = 2.3;
  /// Old places are outlined in dashed red, with an arrow to the new one; what is new in blue.
  std::vector<BirdseyeChange> changes;
};

/// What the events with stamps from `since_ns` on come to, by object: what was added and removed
/// again is no change, and several moves are one.
std::vector<BirdseyeChange> changes_since(const std::vector<ObjectEvent>& events, StampNs since_ns);

/// BGR picture of the map frame's x (right) and y (up). The ground is taken to be the height below
/// which 2 % of the vertices lie. Surfaces whose owner is one of `objects` have the colour of its
/// E[v]: red 0, yellow 0.5, green 1. Boxes are outlined, with their ids.
cv::Mat draw_birdseye(const Mesh& mesh, const std::vector<ObjectSnapshot>& objects,
                      const BirdseyeOptions& options = {});

/// Draws and writes a PNG. Throws InputError naming the file when it is not called .png or cannot
/// be written.
void write_birdseye(const Mesh& mesh, const std::vector<ObjectSnapshot>& objects,
                    const std::filesystem::path& file, const BirdseyeOptions& options = {});

/// BGR colour of a stationarity score in [0, 1]; values outside are clamped.
std::array<std::uint8_t, 3> stationarity_color(double score);

/// For write_ply: objects in the colour of their E[v], with their class; everything else grey.
AppearanceOf appearance_by_stationarity(const std::vector<ObjectSnapshot>& objects);

}  // namespace pocd

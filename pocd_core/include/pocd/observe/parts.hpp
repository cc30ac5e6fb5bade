// Who owns what was measured: known objects, things that have arrived, or nobody yet.
#pragma once

#include <functional>
#include <vector>

#include "pocd/observe/look.hpp"

namespace pocd {

/// A piece of one observation that has one owner.
struct Part {
  std::int32_t observation = 0;
  /// The object whose surface it is or goes on from; null: something new.
  Look* look = nullptr;
  bool explained = false;  ///< the points lie on the object's known surface
  std::vector<SurfacePoint> points;
  /// The points' indices in the observation.
  std::vector<std::int32_t> indices;
};

/// Whether a point [m, W] lies where nothing was seen to be before.
using SeenEmpty = std::function<bool(const Eigen::Vector3f&)>;

struct PartsConfig {
  double spacing_m = 0.05;        ///< of surfels and of the observations' points
  double contact_m = 0.10;        ///< pieces of surface nearer than this touch each other
  std::size_t least_points = 10;  ///< a smaller new piece beside known surface is noise
};

/// Divides the observations among the objects that were looked at. A point near an object's surface
/// is explained by it. The others fall into connected pieces. A piece of which a good part lies
/// where nothing was before belongs to an object that arrived and that it touches, or is something
/// new; another one belongs to the object in place that it touches, or is something new. Objects
/// and observations belong together only if classes agree and, where masks carry instances, no
/// object is in two of them. What has no class (kThing) may lie on any object, which grows by it
/// only within its box.
std::vector<Part> divide(const Observations& observations, Look* looks, std::size_t count,
                         const SeenEmpty& seen_empty, const PartsConfig& config);

/// Paints the owners of the parts (one per part) into the grid: `owner_of_pixel` gets, per pixel of
/// an observation, the object that owns the surface there, else 0. Pixels of an observation with
/// one owner are its; else a pixel belongs to the owner of the point in its cell of `spacing_m`.
void paint_owners(const Observations& observations, const std::vector<Part>& parts,
                  const std::vector<ObjectId>& owners, const OrganizedCloud& cloud,
                  double spacing_m, std::vector<std::uint32_t>& owner_of_pixel);

}  // namespace pocd

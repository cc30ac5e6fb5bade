// Planes of the organised cloud, found on cells of the image grid, and the votes they hold.
#pragma once

#include <cstdint>
#include <vector>

#include "pocd/input/depth_noise.hpp"
#include "pocd/segmentation/organized_cloud.hpp"
#include "pocd/segmentation/segmentation_config.hpp"

namespace pocd {

/// Plane normal_W . p = offset_m; the normal points towards the camera.
struct Plane {
  Eigen::Vector3f normal_W;
  float offset_m = 0.0f;
  Eigen::Vector3f centroid_W;
  int pixels = 0;
};

struct PlaneSegmentation {
  static constexpr int kCellSide = 8;  ///< grid pixels; 64 returns average the noise of one

  std::vector<Plane> planes;
  /// Per grid pixel: index in `planes` or kNoPlane.
  std::vector<std::uint16_t> plane_of;
  static constexpr std::uint16_t kNoPlane = 0xFFFF;
};

/// Fits a plane to each cell in inverse depth, where a plane is linear in the pixel coordinates and
/// stereo noise does not depend on range; grows neighbouring cells of like planes into one
/// (union-find); refits; gives each pixel near a plane of its own or an adjacent cell to it.
void segment_planes(const OrganizedCloud& cloud, const SegmentationConfig& config,
                    const DepthNoise& noise, PlaneSegmentation& out);

/// Step 2 of the method: where at least `majority_share` of a plane's pixels agree on a class, all
/// its pixels get that class (and its kind). Pixels of dynamic and ignored classes neither vote nor
/// change.
void vote_planes(const PlaneSegmentation& planes, double majority_share, OrganizedCloud& cloud);

/// The ground, kept over frames: the place is flat, and many frames see little of it.
class GroundModel {
 public:
  /// Looks for the ground among the planes that face up: those whose pixels are mostly of a ground
  /// class if there are any, else the lowest that is large enough; until there is one, at the level
  /// of the pixels of a ground class, if they agree. A narrow strip holds its tilt for its own
  /// frame only. Then marks as kGround every pixel in the band above the plane, and below it; a
  /// pixel of a ground class elsewhere becomes background, one above `max_height_m` too.
  void update(const PlaneSegmentation& planes, const SegmentationConfig& config,
              const DepthNoise& noise, OrganizedCloud& cloud);

  bool known() const { return known_; }
  /// Height of point (x, y) of the ground [m], map frame. Only when known().
  float height_at(float x, float y) const {
    return (offset_m_ - normal_W_.x() * x - normal_W_.y() * y) / normal_W_.z();
  }

 private:
  friend struct ArchiveAccess;
  bool known_ = false;
  bool from_class_ = false;
  Eigen::Vector3f normal_W_ = Eigen::Vector3f::UnitZ();
  float offset_m_ = 0.0f;
  float level_m_ = 0.0f;  ///< height of the ground where it was seen [m, W]
  bool is_strip_ = false;
};

}  // namespace pocd

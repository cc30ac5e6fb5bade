// What a frame says about the points of an object: measured, seen through, hidden or not in view.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "pocd/input/depth_noise.hpp"
#include "pocd/objects/object_model.hpp"

namespace pocd {

/// Being in the frustum is not being visible. kSeenThrough: the camera measured something farther
/// by more than the margin, all around the point. kHit: it measured the point. kOccluded: something
/// nearer.
enum class Sight : std::uint8_t { kOutOfView, kUnknown, kOccluded, kHit, kSeenThrough };

/// Depth of the grid with nearest-surface filters of growing radius, made once per frame.
class DepthField {
 public:
  /// Uses all returns, also those beyond the depth limit: free space in front of them is free.
  void update(const OrganizedCloud& cloud);

  /// Smallest depth within `radius_px` (rounded up to a prepared radius, clamped to the largest);
  /// +infinity where nothing returned.
  float nearest(int col, int row, float radius_px) const;

 private:
  static constexpr std::array<int, 5> kRadii{1, 2, 4, 8, 16};
  std::array<cv::Mat, kRadii.size()> nearest_;
};

struct SightConfig {
  double margin_m = 0.1;           ///< depth difference that still is the same surface
  double pose_tolerance_m = 0.03;  ///< sideways
  double max_depth_m = 3.0;
  double cover_m = 0.5;  ///< what stands nearer before a point may have taken its place
};

/// Counts of an object's established surfels (those measured in at least `min_hits` frames).
struct Sighting {
  int total = 0;
  int hit = 0;
  int seen_through = 0;
  int occluded = 0;
  int unknown = 0;
  /// Signed depth difference measured - expected [m] at hit and seen-through surfels.
  std::vector<float> differences_m;
  /// Observation index -> surfels it hit, and those it covers close in front.
  struct Touch {
    std::int32_t observation;
    int hit;
    int in_front;
  };
  std::vector<Touch> touches;
  /// Per surfel of the model, for erosion.
  std::vector<Sight> sights;

  int visible() const { return hit + seen_through; }
  double visible_share() const { return total > 0 ? static_cast<double>(visible()) / total : 0.0; }
  double seen_through_share() const {
    return visible() > 0 ? static_cast<double>(seen_through) / visible() : 0.0;
  }
};

/// Projects the model into the frame. Surfels facing away are out of view. Margin: config.margin_m
/// or three sigma of the depth noise and the pose tolerance, whichever is larger.
void sight_object(const std::vector<Surfel>& surfels, int min_hits, const OrganizedCloud& cloud,
                  const DepthField& field, const Observations& observations,
                  const SightConfig& config, const DepthNoise& noise, Sighting& out);

}  // namespace pocd

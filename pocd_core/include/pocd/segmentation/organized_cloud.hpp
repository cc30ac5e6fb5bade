// A frame as an organised semantic cloud: structure of arrays over the image grid after the stride.
#pragma once

#include <cstdint>
#include <vector>

#include "pocd/common/thread_pool.hpp"
#include "pocd/input/class_map.hpp"
#include "pocd/input/frame.hpp"

namespace pocd {

/// What the pipeline does with a pixel.
enum class PixelKind : std::uint8_t { kNone, kGround, kBackground, kObject, kDynamic, kIgnore };

/// Pixel (col, row) is element col + row * width; it stands for image pixels
/// [stride col, stride (col + 1)) x [stride row, stride (row + 1)).
struct OrganizedCloud {
  int width = 0;
  int height = 0;
  int stride = 1;
  CameraModel camera;  ///< of this grid, not of the full image
  Pose T_W_C = Pose::Identity();

  std::vector<float> depth_m;  ///< any range; 0 = no return
  std::vector<float> x_W, y_W, z_W;
  std::vector<ClassId> label;  ///< canonical class (ClassTable), voted by planes and clusters later
  std::vector<std::uint16_t> instance;  ///< 0 where masks carry no instances
  std::vector<PixelKind> kind;          ///< kNone: no return or beyond the depth limit

  std::size_t size() const { return depth_m.size(); }
  Eigen::Vector3f point_W(std::size_t i) const { return {x_W[i], y_W[i], z_W[i]}; }
};

/// A ball around all that the camera sees up to a depth [m, W].
struct ViewBall {
  Eigen::Vector3d center_W;
  double radius_m = 0.0;
};
ViewBall view_ball(const OrganizedCloud& cloud, double max_depth_m);

/// Step 1 of the method: back-projects up to `max_depth_m` and attaches classes. A grid pixel takes
/// the first of its image pixels, in row order, that has a return. Reuses the memory of `cloud`.
void organize(const Frame& frame, int stride, double max_depth_m, const ClassMap& classes,
              const ClassTable& table, ThreadPool& pool, OrganizedCloud& cloud);

}  // namespace pocd

#include <map>
#include <opencv2/imgproc.hpp>

#include "peers.hpp"
#include "pocd/common/check.hpp"
#ifdef POCD_HAS_OPENCV_RGBD
#include <opencv2/core/ocl.hpp>
#include <opencv2/rgbd.hpp>
#include <opencv2/rgbd/volume.hpp>
#endif

namespace pocd::bench {

#ifdef POCD_HAS_OPENCV_RGBD
namespace {

cv::Matx33f intrinsics(const Frame& frame) {
  const CameraModel& c = frame.camera;
  return {static_cast<float>(c.fx),
          0,
          static_cast<float>(c.cx),
          0,
          static_cast<float>(c.fy),
          static_cast<float>(c.cy),
          0,
          0,
          1};
}

cv::Matx44f to_matrix(const Pose& pose) {
  cv::Matx44f matrix;
  for (int k = 0; k < 16; ++k) {
    matrix(k / 4, k % 4) = static_cast<float>(pose.matrix()(k / 4, k % 4));
  }
  return matrix;
}

cv::kinfu::Intr kinfu_intrinsics(const CameraModel& c) {
  return {static_cast<float>(c.fx), static_cast<float>(c.fy), static_cast<float>(c.cx),
          static_cast<float>(c.cy)};
}

// Rays are cast from every so many frames.
constexpr std::size_t kRaycastStride = 10;

}  // namespace

struct HashTsdf::Impl {
  cv::Ptr<cv::kinfu::Volume> volume;
  int frames = 0;
};

bool HashTsdf::available() { return true; }

HashTsdf::HashTsdf(const TsdfConfig& config) : impl_(std::make_unique<Impl>()) {
  cv::ocl::setUseOpenCL(false);
  cv::setNumThreads(1);
  impl_->volume = cv::kinfu::makeVolume(
      cv::kinfu::VolumeType::HASHTSDF, static_cast<float>(config.voxel_size_m), cv::Matx44f::eye(),
      0.25f, static_cast<float>(config.truncation_m()), config.max_weight,
      static_cast<float>(config.max_depth_m), cv::Vec3i(16, 16, 16));
}

void HashTsdf::integrate(const Frame& frame) {
  impl_->volume->integrate(frame.depth_m, 1.0f, to_matrix(frame.T_W_C),
                           kinfu_intrinsics(frame.camera), impl_->frames++);
}

OrientedPoints HashTsdf::surface(const std::vector<Frame>& frames) const {
  struct Mean {
    Eigen::Vector3f points_W = Eigen::Vector3f::Zero(), normals_W = Eigen::Vector3f::Zero();
    float count = 0.0f;
  };
  const float voxel_m = impl_->volume->voxelSize;
  std::map<BlockKey, Mean> cells;
  for (std::size_t i = 0; i < frames.size(); i += kRaycastStride) {
    const Frame& frame = frames[i];
    Pose shifted = frame.T_W_C;
    shifted.translation().array() += 0.5 * voxel_m;
    cv::Mat points, normals;
    impl_->volume->raycast(to_matrix(shifted), kinfu_intrinsics(frame.camera), frame.depth_m.size(),
                           points, normals);
    const Eigen::Isometry3f T_W_C = frame.T_W_C.cast<float>();  // the shift undone
    for (int v = 0; v < points.rows; ++v) {
      for (int u = 0; u < points.cols; ++u) {
        const float* p = points.ptr<float>(v) + 4 * u;
        const float* n = normals.ptr<float>(v) + 4 * u;
        const Eigen::Vector3f point_W = T_W_C * Eigen::Vector3f(p[0], p[1], p[2]);
        const Eigen::Vector3f normal_W = T_W_C.linear() * Eigen::Vector3f(n[0], n[1], n[2]);
        if (!point_W.allFinite() || !normal_W.allFinite()) continue;
        const Eigen::Vector3f cell = (point_W / voxel_m).array().floor();
        Mean& mean = cells[{static_cast<int>(cell.x()), static_cast<int>(cell.y()),
                            static_cast<int>(cell.z())}];
        mean.points_W += point_W;
        mean.normals_W += normal_W;
        mean.count += 1.0f;
      }
    }
  }
  OrientedPoints surface;
  for (const auto& [key, mean] : cells) {
    surface.points_W.push_back(mean.points_W / mean.count);
    surface.normals_W.push_back(mean.normals_W.normalized());
  }
  return surface;
}

cv::Mat opencv_points(const Frame& frame) {
  cv::Mat points;
  cv::rgbd::depthTo3d(frame.depth_m, intrinsics(frame), points);
  return points;
}

cv::Mat opencv_normals(const Frame& frame, const cv::Mat& points) {
  static const cv::Ptr<cv::rgbd::RgbdNormals> maker = cv::makePtr<cv::rgbd::RgbdNormals>(
      frame.depth_m.rows, frame.depth_m.cols, CV_32F, intrinsics(frame), 5,
      cv::rgbd::RgbdNormals::RGBD_NORMALS_METHOD_FALS);
  if (maker->getRows() != frame.depth_m.rows || maker->getCols() != frame.depth_m.cols) {
    maker->setRows(frame.depth_m.rows);
    maker->setCols(frame.depth_m.cols);
    maker->setK(cv::Mat(intrinsics(frame)));
    maker->initialize();
  }
  cv::Mat normals;
  (*maker)(points, normals);
  return normals;
}

int opencv_planes(const Frame& frame, const cv::Mat& points, const cv::Mat& normals) {
  cv::rgbd::RgbdPlane finder;
  finder.setMinSize(2000);
  finder.setThreshold(0.03);
  cv::Mat mask, coefficients;
  static_cast<void>(frame);
  finder(points, normals, mask, coefficients);
  return static_cast<int>(coefficients.total());
}
#else
struct HashTsdf::Impl {};
bool HashTsdf::available() { return false; }
HashTsdf::HashTsdf(const TsdfConfig&) {}
void HashTsdf::integrate(const Frame&) {}
OrientedPoints HashTsdf::surface(const std::vector<Frame>&) const { return {}; }
cv::Mat opencv_points(const Frame&) { return {}; }
cv::Mat opencv_normals(const Frame&, const cv::Mat&) { return {}; }
int opencv_planes(const Frame&, const cv::Mat&, const cv::Mat&) { return 0; }
#endif

HashTsdf::~HashTsdf() = default;

int opencv_components(const Frame& frame, double max_depth_m, double step_m) {
  cv::Mat farthest, nearest;
  cv::dilate(frame.depth_m, farthest, {});
  cv::erode(frame.depth_m, nearest, {});
  const cv::Mat joined =
      (frame.depth_m > 0.0f) & (frame.depth_m <= max_depth_m) & (farthest - nearest < step_m);
  cv::Mat labels;
  return cv::connectedComponents(joined, labels, 4, CV_32S);
}

}  // namespace pocd::bench

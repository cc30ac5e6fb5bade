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

Points to_points(const cv::Mat& rows) {
  Points points;
  for (int i = 0; i < rows.rows; ++i) {
    const float* p = rows.ptr<float>(i);
    points.emplace_back(p[0], p[1], p[2]);
  }
  return points;
}

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
  cv::Matx44f pose;
  for (int k = 0; k < 16; ++k) {
    pose(k / 4, k % 4) = static_cast<float>(frame.T_W_C.matrix()(k / 4, k % 4));
  }
  const CameraModel& c = frame.camera;
  const cv::kinfu::Intr intr(static_cast<float>(c.fx), static_cast<float>(c.fy),
                             static_cast<float>(c.cx), static_cast<float>(c.cy));
  impl_->volume->integrate(frame.depth_m, 1.0f, pose, intr, impl_->frames++);
}

OrientedPoints HashTsdf::surface() const {
  cv::Mat points, normals;
  impl_->volume->fetchPointsNormals(points, normals);
  return {to_points(points), to_points(normals)};
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
OrientedPoints HashTsdf::surface() const { return {}; }
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

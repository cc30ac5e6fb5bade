#include "pocd/segmentation/organized_cloud.hpp"

namespace pocd {
namespace {

PixelKind kind_of(ClassRole role) {
  switch (role) {
    case ClassRole::kGround:
      return PixelKind::kGround;
    case ClassRole::kObject:
      return PixelKind::kObject;
    case ClassRole::kDynamic:
      return PixelKind::kDynamic;
    case ClassRole::kIgnore:
      return PixelKind::kIgnore;
    case ClassRole::kBackground:
      break;
  }
  return PixelKind::kBackground;
}

struct Source {
  int col = 0, row = 0;
  float depth = 0.0f;
};

/// First pixel with a return among those the grid pixel stands for.
Source first_return(const cv::Mat& depth, int col, int row, int stride) {
  for (int v = row * stride; v < (row + 1) * stride; ++v) {
    const float* line = depth.ptr<float>(v);
    for (int u = col * stride; u < (col + 1) * stride; ++u) {
      if (line[u] > 0.0f) return {u, v, line[u]};
    }
  }
  return {col * stride, row * stride, 0.0f};
}

}  // namespace

void organize(const Frame& frame, int stride, double max_depth_m, const ClassMap& classes,
              const ClassTable& table, ThreadPool& pool, OrganizedCloud& cloud) {
  cloud.width = frame.camera.width / stride;
  cloud.height = frame.camera.height / stride;
  cloud.stride = stride;
  cloud.camera = {cloud.width,
                  cloud.height,
                  frame.camera.fx / stride,
                  frame.camera.fy / stride,
                  frame.camera.cx / stride,
                  frame.camera.cy / stride};
  cloud.T_W_C = frame.T_W_C;
  const std::size_t size = static_cast<std::size_t>(cloud.width) * cloud.height;
  cloud.depth_m.resize(size);
  cloud.x_W.resize(size);
  cloud.y_W.resize(size);
  cloud.z_W.resize(size);
  cloud.label.resize(size);
  cloud.instance.resize(size);
  cloud.kind.resize(size);

  const Eigen::Matrix3f R = frame.T_W_C.linear().cast<float>();
  const Eigen::Vector3f t = frame.T_W_C.translation().cast<float>();
  const float fx = static_cast<float>(frame.camera.fx), fy = static_cast<float>(frame.camera.fy);
  const float cx = static_cast<float>(frame.camera.cx), cy = static_cast<float>(frame.camera.cy);
  const float limit = static_cast<float>(max_depth_m);
  const int divisor = classes.label_divisor;
  const ClassId default_class = table.canonical(static_cast<ClassId>(classes.default_class));

  pool.parallel_for(cloud.height, 16, [&](std::size_t begin, std::size_t end) {
    for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
      for (int col = 0; col < cloud.width; ++col) {
        const std::size_t i = static_cast<std::size_t>(row) * cloud.width + col;
        const Source source = first_return(frame.depth_m, col, row, stride);
        cloud.depth_m[i] = source.depth;
        const Eigen::Vector3f p_C{(static_cast<float>(source.col) - cx) / fx * source.depth,
                                  (static_cast<float>(source.row) - cy) / fy * source.depth,
                                  source.depth};
        const Eigen::Vector3f p_W = R * p_C + t;
        cloud.x_W[i] = p_W.x();
        cloud.y_W[i] = p_W.y();
        cloud.z_W[i] = p_W.z();
        ClassId label = default_class;
        std::uint16_t instance = 0;
        if (!frame.labels.empty()) {
          const int value = frame.labels.at<std::uint16_t>(source.row, source.col);
          label = table.canonical(static_cast<ClassId>(value / divisor));
          instance = static_cast<std::uint16_t>(value % divisor);
        }
        cloud.label[i] = label;
        cloud.instance[i] = instance;
        const bool usable = source.depth > 0.0f && source.depth <= limit;
        cloud.kind[i] = usable ? kind_of(table.role(label)) : PixelKind::kNone;
      }
    }
  });
}

}  // namespace pocd

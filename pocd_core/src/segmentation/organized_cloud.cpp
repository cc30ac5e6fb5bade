#include "pocd/segmentation/organized_cloud.hpp"

#include <algorithm>

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

ClassTable::ClassTable(const ClassMap& map) {
  int highest = map.default_class;
  for (const ClassInfo& info : map.list) highest = std::max(highest, info.id);
  for (int id = 0; id <= highest; ++id) {
    const auto info = std::find_if(map.list.begin(), map.list.end(),
                                   [&](const ClassInfo& c) { return c.id == id; });
    int first = id;
    if (info != map.list.end() && !info->name.empty()) {
      first = std::find_if(map.list.begin(), map.list.end(), [&](const ClassInfo& c) {
                return c.name == info->name;
              })->id;
    }
    canonical_.push_back(static_cast<ClassId>(first));
    role_.push_back(map.role(static_cast<ClassId>(id)));
  }
}

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

  // Rays of unit depth, by column and row of the image.
  std::vector<float> ray_x(frame.camera.width), ray_y(frame.camera.height);
  for (int u = 0; u < frame.camera.width; ++u) ray_x[u] = (static_cast<float>(u) - cx) / fx;
  for (int v = 0; v < frame.camera.height; ++v) ray_y[v] = (static_cast<float>(v) - cy) / fy;
  const PixelKind default_kind = kind_of(table.role(default_class));

  pool.parallel_for(cloud.height, 16, [&](std::size_t begin, std::size_t end) {
    // Masks are patches of one value: the last look-up is nearly always the next one, too.
    int last_value = -1;
    ClassId label = default_class;
    std::uint16_t instance = 0;
    PixelKind kind = default_kind;
    for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
      const float* image_row = frame.depth_m.ptr<float>(row * stride);
      for (int col = 0; col < cloud.width; ++col) {
        const std::size_t i = static_cast<std::size_t>(row) * cloud.width + col;
        Source source{col * stride, row * stride, image_row[col * stride]};
        if (!(source.depth > 0.0f)) source = first_return(frame.depth_m, col, row, stride);
        cloud.depth_m[i] = source.depth;
        const Eigen::Vector3f p_C{ray_x[source.col] * source.depth,
                                  ray_y[source.row] * source.depth, source.depth};
        const Eigen::Vector3f p_W = R * p_C + t;
        cloud.x_W[i] = p_W.x();
        cloud.y_W[i] = p_W.y();
        cloud.z_W[i] = p_W.z();
        if (!frame.labels.empty()) {
          const int value = frame.labels.at<std::uint16_t>(source.row, source.col);
          if (value != last_value) {
            last_value = value;
            label = table.canonical(static_cast<ClassId>(value / divisor));
            instance = static_cast<std::uint16_t>(value % divisor);
            kind = kind_of(table.role(label));
          }
        }
        cloud.label[i] = label;
        cloud.instance[i] = instance;
        const bool usable = source.depth > 0.0f && source.depth <= limit;
        cloud.kind[i] = usable ? kind : PixelKind::kNone;
      }
    }
  });
}

ViewBall view_ball(const OrganizedCloud& cloud, double max_depth_m) {
  const CameraModel& camera = cloud.camera;
  const double half_width = std::max(camera.cx, cloud.width - camera.cx) / camera.fx;
  const double half_height = std::max(camera.cy, cloud.height - camera.cy) / camera.fy;
  // The frustum lies within a ball around the point half way to its far end.
  const Eigen::Vector3d half_way = 0.5 * max_depth_m * cloud.T_W_C.linear().col(2);
  return {cloud.T_W_C.translation() + half_way,
          max_depth_m * std::hypot(0.5, std::hypot(half_width, half_height))};
}

}  // namespace pocd

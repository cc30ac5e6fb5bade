#include "pocd/datasets/torwic_writer.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iomanip>
#include <string>

#include "pocd/common/check.hpp"
#include "pocd/common/image_codec.hpp"

namespace pocd {
namespace {

cv::Mat in_millimetres(const cv::Mat& depth_m) {
  cv::Mat out(depth_m.rows, depth_m.cols, CV_16UC1);
  for (int v = 0; v < depth_m.rows; ++v) {
    const float* in = depth_m.ptr<float>(v);
    std::uint16_t* mm = out.ptr<std::uint16_t>(v);
    for (int u = 0; u < depth_m.cols; ++u) {
      const float value = std::round(in[u] * 1000.0f);
      mm[u] = value > 0.0f && value < 65535.0f ? static_cast<std::uint16_t>(value) : 0;
    }
  }
  return out;
}

}  // namespace

TorwicWriter::TorwicWriter(const std::filesystem::path& folder, const Pose& T_B_C)
    : folder_(folder), T_C_B_(T_B_C.inverse()) {
  std::error_code error;
  for (const char* name : {"RGB", "Depth", "Segmentation"}) {
    std::filesystem::create_directories(folder / name, error);
    if (error) throw InputError((folder / name).string() + ": cannot be made: " + error.message());
  }
  poses_.open(folder / "poses.txt");
  if (!poses_) throw InputError((folder / "poses.txt").string() + ": cannot be written");
  poses_ << std::setprecision(17);
}

void TorwicWriter::write(const Frame& frame) {
  char name[16];
  std::snprintf(name, sizeof name, "%04d.png", next_);
  write_png(folder_ / "Depth" / name, in_millimetres(frame.depth_m));
  if (!frame.labels.empty()) write_png(folder_ / "Segmentation" / name, frame.labels);
  if (!frame.color.empty()) write_png(folder_ / "RGB" / name, frame.color);
  const Pose T_W_B = frame.T_W_C * T_C_B_;
  const Eigen::Vector3d p = T_W_B.translation();
  const Eigen::Quaterniond q(T_W_B.linear());
  poses_ << next_ << ' ' << frame.stamp_ns / 1'000'000'000 << ' ' << frame.stamp_ns % 1'000'000'000
         << ' ' << p.x() << ' ' << p.y() << ' ' << p.z() << ' ' << q.x() << ' ' << q.y() << ' '
         << q.z() << ' ' << q.w() << '\n'
         << std::flush;
  if (!poses_) throw InputError((folder_ / "poses.txt").string() + ": cannot be written");
  ++next_;
}

}  // namespace pocd

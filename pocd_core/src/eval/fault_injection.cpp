#include "pocd/eval/fault_injection.hpp"

#include <array>
#include <cmath>

#include "pocd/common/random.hpp"

namespace pocd {
namespace {

enum class Fault { kPoseJump, kMaskGap, kDepthHoles };

constexpr double kFrame_s = 1.0 / 15.0;  // a jump lasts one to five periods

void punch_holes(Random& random, double share, cv::Mat& depth_m) {
  depth_m = depth_m.clone();  // frames share their images
  for (int v = 0; v < depth_m.rows; ++v) {
    float* row = depth_m.ptr<float>(v);
    for (int u = 0; u < depth_m.cols; ++u) {
      if (random.uniform() < share) row[u] = 0.0f;
    }
  }
}

}  // namespace

void inject_faults(const FaultOptions& options, StampNs start_ns, Frame& frame) {
  std::array<Fault, 3> chosen{};
  std::size_t count = 0;
  if (options.pose_jumps) chosen[count++] = Fault::kPoseJump;
  if (options.mask_gaps) chosen[count++] = Fault::kMaskGap;
  if (options.depth_holes) chosen[count++] = Fault::kDepthHoles;
  if (count == 0) return;
  const double time_s =
      static_cast<double>(frame.stamp_ns - start_ns) * 1e-9 - options.period_s / 2.0;
  if (time_s < 0.0) return;
  const auto episode = static_cast<std::uint64_t>(time_s / options.period_s);
  const double into_s = time_s - static_cast<double>(episode) * options.period_s;
  Random of_episode(options.seed * 0x9E3779B97F4A7C15ull + episode);
  switch (chosen[episode % count]) {
    case Fault::kPoseJump: {
      const double lasts_s = kFrame_s * static_cast<double>(1 + of_episode.below(5));
      const double heading = of_episode.uniform(-M_PI, M_PI);
      if (into_s >= lasts_s) return;
      frame.T_W_C.translation() +=
          options.jump_m * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0);
      return;
    }
    case Fault::kMaskGap:
      if (into_s < options.gap_s) frame.labels = cv::Mat();
      return;
    case Fault::kDepthHoles: {
      if (into_s >= options.gap_s) return;
      Random of_frame(options.seed ^
                      (static_cast<std::uint64_t>(frame.stamp_ns) * 0xBF58476D1CE4E5B9ull));
      punch_holes(of_frame, options.hole_share, frame.depth_m);
      return;
    }
  }
}

}  // namespace pocd

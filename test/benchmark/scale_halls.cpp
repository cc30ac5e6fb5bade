#include "scale_halls.hpp"

#include <cmath>

#include "heap_counter.hpp"
#include "pocd/common/check.hpp"
#include "test_room.hpp"

namespace pocd::benchmark {
namespace {

constexpr double kLength_m = 12.8, kWidth_m = 8.0, kGap_m = 6.4;
constexpr StampNs kPeriod_ns = 66'666'667;

Scene hall() {
  Scene scene;
  scene.objects.push_back(test::solid(test::kFloorClass, {kLength_m / 2, kWidth_m / 2},
                                      {kLength_m, kWidth_m, 0.2}, 0.0, -0.2));
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 2; ++j) {
      scene.objects.push_back(test::solid(test::kBoxClass, {1.6 + 2.4 * i, 2.2 + 3.6 * j},
                                          {0.6, 0.6, 0.7 + 0.1 * (i % 3)}, 0.2 * i));
    }
  }
  return scene;
}

// Looking along +x, down by 0.45 rad.
Pose camera_at(double x_m, double y_m) { return test::look_from({x_m, y_m, 1.3}, -M_PI / 2, 0.45); }

}  // namespace

PipelineConfig scale_config() {
  PipelineConfig config = test::room_config();
  // From the end of an aisle to the beginning of the next one is a jump.
  config.pose_gate.slack_m = 100.0;
  return config;
}

std::vector<Frame> drive_through_hall(double step_m, std::uint64_t seed) {
  const Scene scene = hall();
  const CameraModel camera{160, 120, 100.0, 100.0, 79.5, 59.5};
  std::vector<Frame> frames;
  for (const double y : {0.7, 4.0, 7.3}) {
    for (double x = -2.0; x < kLength_m - 1.0; x += step_m) {
      const Pose T_W_C = camera_at(x, y);
      const RenderedFrame picture = render(scene, camera, T_W_C, false);
      Frame frame;
      frame.sequence = frames.size();
      frame.camera = camera;
      frame.T_W_C = T_W_C;
      frame.depth_m = picture.depth_m;
      frame.labels = picture.labels;
      test::add_noise(frame, scale_config().depth_noise, seed);
      frames.push_back(std::move(frame));
    }
  }
  return frames;
}

Site::Site(const PipelineConfig& config, int halls, const std::vector<Frame>& drive)
    : halls_(halls), publisher_(1, config.map) {
  const auto in_use = [] { return static_cast<std::int64_t>(heap_in_use()); };
  const std::int64_t start = in_use();
  pipeline_ = std::make_unique<PocdPipeline>(config);
  for (int n = 0; n < halls; ++n) {
    for (const Frame& frame : drive) process_at(frame, place_m(n), "robot" + std::to_string(n));
    const std::int64_t between = in_use();
    publish();
    publisher_heap_ += in_use() - between;
  }
  pipeline_heap_ = in_use() - start - publisher_heap_;
}

Eigen::Vector2d Site::place_m(int hall) const {
  const int columns = static_cast<int>(std::ceil(std::sqrt(halls_)));
  return {(hall % columns) * (kLength_m + kGap_m), (hall / columns) * (kWidth_m + kGap_m)};
}

void Site::process_at(Frame frame, const Eigen::Vector2d& at_m, const std::string& robot) {
  frame.T_W_C.translation() += Eigen::Vector3d(at_m.x(), at_m.y(), 0.0);
  frame.stamp_ns = stamp_ns_ += kPeriod_ns;
  frame.sequence = sequence_++;
  frame.robot = robot;
  if (!pipeline_->process_frame(frame).accepted) throw InputError("a frame of a hall was refused");
}

FrameResult Site::process(const Frame& frame) {
  Frame now = frame;  // shares the images
  now.stamp_ns = stamp_ns_ += kPeriod_ns;
  now.sequence = sequence_++;
  now.robot = "robot0";
  FrameResult result = pipeline_->process_frame(now);
  if (!result.accepted) throw InputError("a frame of a hall was refused");
  return result;
}

std::size_t Site::publish() {
  const auto delta = publisher_.update(pipeline_->map());
  return delta ? delta->changed.size() : 0;
}

}  // namespace pocd::benchmark

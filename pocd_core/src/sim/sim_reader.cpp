#include "pocd/sim/sim_reader.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

/// Stamp 0 means "no time" on many buses, so a run starts later.
constexpr StampNs kStart_ns = 1'000'000'000;

StampNs to_ns(double seconds) { return static_cast<StampNs>(std::llround(seconds * 1e9)); }

const Scenario& checked(const Scenario& scenario) {
  validate(scenario);
  return scenario;
}

/// Replaces class by class * divisor + instance; instances are numbered per class over the visit.
void add_instances(const Scenario& scenario, std::size_t visit, const Scene& scene, int divisor,
                   RenderedFrame& rendered) {
  std::map<ClassId, int> count;
  std::map<std::string, int> instance;
  for (const SceneObject& object : scenario.visits[visit].objects) {
    instance[object.name] = ++count[object.class_id];
  }
  std::vector<std::uint16_t> code(scene.objects.size());
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject& object = scene.objects[i];
    const int number = object.fixture ? 0 : instance.at(object.name);
    POCD_CHECK(number < divisor && object.class_id * divisor + number <= 65535);
    code[i] = static_cast<std::uint16_t>(object.class_id * divisor + number);
  }
  for (int v = 0; v < rendered.labels.rows; ++v) {
    const std::int32_t* id = rendered.objects.ptr<std::int32_t>(v);
    std::uint16_t* label = rendered.labels.ptr<std::uint16_t>(v);
    for (int u = 0; u < rendered.labels.cols; ++u) label[u] = id[u] < 0 ? 0 : code[id[u]];
  }
}

}  // namespace

SimSchedule::SimSchedule(const Scenario& scenario)
    : T_B_C_(scenario.extrinsics.T_B_C), base_height_m_(scenario.base_height_m) {
  for (const SimRobot& robot : scenario.robots) {
    paths_.emplace_back(robot.path, "scenario '" + scenario.name + "': robot '" + robot.name + "'");
  }
  const double period_s = 1.0 / scenario.frame_rate_hz;
  std::vector<std::size_t> sequence(paths_.size(), 0);
  double visit_start_s = 0.0;
  for (std::size_t visit = 0; visit < scenario.visits.size(); ++visit) {
    const std::size_t first = frames_.size();
    double longest_s = 0.0;
    for (std::size_t r = 0; r < paths_.size(); ++r) {
      const double shift_s = period_s * static_cast<double>(r) / static_cast<double>(paths_.size());
      longest_s = std::max(longest_s, paths_[r].duration_s());
      for (std::size_t k = 0;; ++k) {
        const double time_s = static_cast<double>(k) * period_s + shift_s;
        if (time_s > paths_[r].duration_s()) break;
        frames_.push_back(
            {kStart_ns + to_ns(visit_start_s + time_s), visit, r, k, sequence[r]++, time_s});
      }
    }
    std::stable_sort(
        frames_.begin() + static_cast<std::ptrdiff_t>(first), frames_.end(),
        [](const SimFrameTime& a, const SimFrameTime& b) { return a.stamp_ns < b.stamp_ns; });
    visit_start_s += longest_s + period_s + scenario.visit_gap_s;
  }
}

Pose SimSchedule::camera_at(const SimFrameTime& when) const {
  Pose T_W_B = paths_.at(when.robot).base_at(when.visit_time_s);
  T_W_B.translation().z() += base_height_m_;
  return T_W_B * T_B_C_;
}

SimReader::SimReader(Scenario scenario, const SimReaderOptions& options)
    : scenario_(std::move(scenario)),
      options_(options),
      schedule_(checked(scenario_)),
      pool_(options.threads > 1 ? std::make_unique<ThreadPool>(options.threads) : nullptr) {
  if (options_.label_divisor < 1) throw InputError("simulator: label_divisor must be >= 1");
}

std::optional<Frame> SimReader::next() {
  if (next_ >= size()) return std::nullopt;
  return frame(next_++);
}

Frame SimReader::true_frame(std::size_t index) const {
  const SimFrameTime& when = schedule_.frames().at(index);
  const Scene scene = scene_at(scenario_, when.visit, when.visit_time_s);
  const Pose T_W_C = schedule_.camera_at(when);
  RenderedFrame rendered = render(scene, scenario_.camera, T_W_C, options_.with_color, pool_.get());
  if (options_.label_divisor > 1) {
    add_instances(scenario_, when.visit, scene, options_.label_divisor, rendered);
  }
  Frame frame;
  frame.stamp_ns = when.stamp_ns;
  frame.sequence = index;
  frame.robot = scenario_.robots[when.robot].name;
  frame.camera = scenario_.camera;
  frame.T_W_C = T_W_C;
  frame.depth_m = rendered.depth_m;
  frame.labels = rendered.labels;
  frame.color = rendered.color;
  return frame;
}

Frame SimReader::frame(std::size_t index) const {
  Frame frame = true_frame(index);
  const SimFrameTime& when = schedule_.frames()[index];
  const NoiseKey key{options_.seed, when.robot, when.robot_sequence};
  degrade_depth(scenario_.sensor, key, frame.depth_m);
  degrade_labels(scenario_.sensor, key, options_.label_divisor, frame.labels);
  if (!frame.color.empty()) degrade_color(scenario_.sensor, key, frame.color);
  frame.T_W_C =
      degrade_pose(scenario_.sensor, key, 1e-9 * static_cast<double>(when.stamp_ns), frame.T_W_C);
  return frame;
}

}  // namespace pocd

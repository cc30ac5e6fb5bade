// The simulator as a source of frames.
#pragma once

#include <memory>

#include "pocd/common/thread_pool.hpp"
#include "pocd/input/dataset_reader.hpp"
#include "pocd/sim/render.hpp"
#include "pocd/sim/robot_path.hpp"
#include "pocd/sim/scenario.hpp"

namespace pocd {

/// When and by whom a frame is taken.
struct SimFrameTime {
  StampNs stamp_ns = 0;
  std::size_t visit = 0;
  std::size_t robot = 0;
  std::size_t robot_frame = 0;     ///< number within the robot's frames of this visit
  std::size_t robot_sequence = 0;  ///< number within the robot's frames of the run
  double visit_time_s = 0.0;
};

/// All frames of a run in the order of their stamps. The first visit starts at 1 s. Robots take
/// frames at the scenario's rate, shifted against each other by equal parts of the period; a robot
/// that is done waits for the others, without frames.
class SimSchedule {
 public:
  explicit SimSchedule(const Scenario& scenario);

  const std::vector<SimFrameTime>& frames() const { return frames_; }
  /// True camera pose T_W_C.
  Pose camera_at(const SimFrameTime& when) const;

 private:
  std::vector<RobotPath> paths_;
  Pose T_B_C_;
  double base_height_m_;
  std::vector<SimFrameTime> frames_;
};

struct SimReaderOptions {
  std::uint64_t seed = 1;
  int label_divisor =
      1;  ///< > 1: labels are class * label_divisor + instance (1, 2, ... per class)
  bool with_color = true;
  int threads = 1;  ///< of the renderer; frames do not depend on it
};

/// next() walks through the run; frame(i) gives any frame, and the same one every time.
/// Thread-safe only with threads == 1 and through const members.
class SimReader : public DatasetReader {
 public:
  /// Throws InputError when the scenario is not valid.
  SimReader(Scenario scenario, const SimReaderOptions& options);

  std::optional<Frame> next() override;
  std::size_t size() const override { return schedule_.frames().size(); }
  CameraExtrinsics extrinsics() const override { return scenario_.extrinsics; }

  const Scenario& scenario() const { return scenario_; }
  const SimSchedule& schedule() const { return schedule_; }
  /// As measured: degraded by the scenario's sensor model.
  Frame frame(std::size_t index) const;
  /// As it is: exact depth, labels and pose.
  Frame true_frame(std::size_t index) const;

 private:
  Scenario scenario_;
  SimReaderOptions options_;
  SimSchedule schedule_;
  std::unique_ptr<ThreadPool> pool_;
  std::size_t next_ = 0;
};

}  // namespace pocd

#include "pocd_dds/node/intake.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace pocd::dds {
namespace {

// Frames of one robot that wait for another robot's. A robot that falls this far behind is not slow
// on the bus: it has no frames in this stretch of the replay.
constexpr std::size_t kMostBehind = 64;
constexpr std::chrono::milliseconds kIdle{100};

}  // namespace

Intake::Intake(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
               const ClassMap& classes, FrameQueue& queue)
    : lossless_(node.lossless),
      queue_(queue),
      colours_(classes),
      tf_(participant, topics::kTf, wakeup_),
      tf_static_(participant, topics::kTfStatic, wakeup_),
      merger_(static_cast<StampNs>(node.merge_wait_s * 1e9)) {
  for (const RobotConfig& robot : node.robots) {
    robots_.push_back(
        std::make_unique<RobotInput>(participant, node, robot, colours_, problems_, wakeup_));
  }
  update_status();
  thread_ = std::thread([this] { run(); });
}

Intake::~Intake() { stop(); }

void Intake::stop() {
  stopping_ = true;
  wakeup_.wake();
  if (thread_.joinable()) thread_.join();
}

void Intake::run() {
  while (!stopping_) {
    wakeup_.wait_for(kIdle);
    step(false);
  }
  step(true);
  queue_.close();
}

void Intake::step(bool last) {
  drain_transforms(tf_static_, true);
  drain_transforms(tf_, false);
  for (const auto& robot : robots_) {
    const bool hold = lossless_ && !last && merger_.pending(robot->name()) >= kMostBehind;
    robot->drain(hold);
    for (Frame& frame : robot->take(last)) {
      const StampNs stamp_ns = frame.stamp_ns;
      merger_.add(robot->name(), stamp_ns, std::move(frame));
    }
    if (robot->settle_departure())
      spdlog::info("{}: the source of its images has gone", robot->name());
    merger_.set_live(robot->name(), robot->live());
    merger_.set_watermark(robot->name(), robot->watermark_ns());
  }
  hand_over(last);
  update_status();
}

void Intake::hand_over(bool last) {
  while (last || !lossless_ || queue_.has_room()) {
    const bool far_behind = std::any_of(robots_.begin(), robots_.end(), [&](const auto& robot) {
      return merger_.pending(robot->name()) >= kMostBehind;
    });
    std::optional<Frame> frame = merger_.take(last || far_behind);
    if (!frame) return;
    if (lossless_ || last) {
      queue_.push(std::move(*frame));
    } else {
      queue_.push_dropping(std::move(*frame));
    }
  }
}

void Intake::drain_transforms(TfReader& reader, bool is_static) {
  tf2_msgs::msg::TFMessage message;
  SampleMeta meta;
  while (reader.take(message, meta)) {
    if (!meta.valid) continue;
    for (const auto& transform : message.transforms()) {
      const Checked<StampedTransform> checked = transform_from(transform);
      if (checked.problem) {
        problems_.count(reader.topic(), *checked.problem);
        continue;
      }
      bool in_order = true;
      for (const auto& robot : robots_) {
        in_order = robot->add_transform(*checked.value, is_static) && in_order;
      }
      if (!in_order) {
        problems_.count(reader.topic(), {InputReason::kStampBackwards,
                                         checked.value->parent + " -> " + checked.value->child +
                                             ": stamp is before the last one"});
      }
    }
  }
}

void Intake::update_status() {
  IntakeStatus status;
  for (const auto& robot : robots_) {
    std::string waiting = robot->waiting_for();
    if (waiting.empty() && merger_.waits_for() == robot->name()) {
      waiting = "the other robots wait for its next frame";
    }
    status.robots.push_back({robot->name(), robot->live(), robot->frames(), robot->dropped(),
                             robot->lost(), std::move(waiting)});
  }
  status.problems = problems_.entries();
  const std::lock_guard<std::mutex> lock(status_mutex_);
  status_ = std::move(status);
}

IntakeStatus Intake::status() const {
  const std::lock_guard<std::mutex> lock(status_mutex_);
  return status_;
}

}  // namespace pocd::dds

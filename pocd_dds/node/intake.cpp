#include "pocd_dds/node/intake.hpp"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"
#include "pocd/input/robot_topic.hpp"
#include "pocd_dds/node/input_delivery.hpp"

namespace pocd::dds {
namespace {

// Frames of one robot that wait for another robot's. A robot that falls this far behind is not slow
// on the bus: it has no frames in this stretch of the replay.
constexpr std::size_t kMostBehind = 64;
constexpr std::size_t kMostDepartures = 16;
// Whoever announces a depth image is a robot; each takes readers and memory.
constexpr std::size_t kMostRobots = 200;
constexpr std::chrono::milliseconds kIdle{100};

StampNs wall_clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

Intake::Intake(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
               const PipelineConfig& pipeline, BusWatch& watch, FrameQueue& queue,
               LatencyLog& latency)
    : participant_(participant),
      node_(node),
      watch_(watch),
      queue_(queue),
      latency_(latency),
      labels_(pipeline.classes),
      topics_(node),
      roster_(node),
      transforms_(static_cast<StampNs>(node.max_pose_gap_s * 1e9)),
      tf_(node.topics.own_tf()
              ? nullptr
              : std::make_unique<TransformInput>(participant, bus_name(node.topics.tf),
                                                 bus_name(node.topics.tf_static),
                                                 input_delivery(topics::kTf, node), tf_wakeup_)),
      context_{node_, labels_, pipeline.map.max_depth_m, transforms_, problems_},
      merger_(static_cast<StampNs>(node.merge_wait_s * 1e9)) {
  for (const RobotConfig& robot : node.robots) meet(robot.name, robot, true);
  update_status();
  watch_.set_wake([this] { wakeup_.wake(); });
  thread_ = std::thread([this] { run(); });
}

Intake::~Intake() {
  stop();
  watch_.set_wake(nullptr);
}

void Intake::stop() {
  stopping_ = true;
  wakeup_.wake();
  if (thread_.joinable()) thread_.join();
}

void Intake::run() {
  pthread_setname_np(pthread_self(), "pocd_intake");
  try {
    while (!stopping_) {
      wakeup_.wait_for(kIdle);
      step(false);
      pulse_.beat();
    }
    step(true);
  } catch (...) {
    failure_ = std::current_exception();
    failed_ = true;
  }
  queue_.close();
}

void Intake::meet(const std::string& name, const RobotConfig& config, bool named) {
  Robot& robot = robots_[name];
  robot.named = named;
  robot.wakeup = std::make_unique<Wakeup>(wakeup_);
  robot.input = std::make_unique<RobotInput>(participant_, node_, config, context_, problems_,
                                             *robot.wakeup, latency_);
  // Setting a fleet up takes time, in which what was latched goes on to arrive.
  if (tf_) tf_->drain_static(transforms_, problems_);
}

bool Intake::follow_roster() {
  const auto now = Roster::Clock::now();
  const std::vector<BusEvent> events = watch_.take();
  for (const BusEvent& event : events) {
    check_type(event);
    follow(roster_.hear(event, now));
  }
  const std::vector<RosterChange> settled = roster_.settle(now);
  follow(settled);
  return !events.empty() || !settled.empty();
}

// Fast DDS keeps quiet about it: a writer of another type just never matches.
void Intake::check_type(const BusEvent& event) {
  if (event.kind != BusEvent::Kind::kEndpoint || !event.endpoint.writer) return;
  const BusEndpoint& endpoint = event.endpoint;
  for (const InputTopic& to : topics_.find(endpoint.topic)) {
    const TopicSpec expected = spec_of(to.stream, endpoint.topic);
    if (endpoint.type == expected.type) continue;
    const bool compressed = is_image(to.stream) && endpoint.type == topics::kCompressedImageType;
    problems_.count(endpoint.topic,
                    {InputReason::kWrongType,
                     "has type " + endpoint.type + ", expected " + expected.type +
                         (compressed ? "; the name of a compressed topic has to end in /compressed "
                                       "or /compressedDepth"
                                     : "")});
    return;
  }
}

void Intake::follow(const std::vector<RosterChange>& changes) {
  for (const RosterChange& change : changes) {
    if (!change.present) {
      go(change);
    } else if (robots_.count(change.robot) == 0 && robots_.size() >= kMostRobots) {
      turned_away_.insert(change.robot);
      problems_.count(bus_name(robot_topic(node_.topics.depth, change.robot)), "too_many_robots",
                      "there are " + std::to_string(kMostRobots) + " already: not listened to", 1);
    } else {
      come(change.robot);
    }
  }
  meet_those_turned_away();
}

void Intake::go(const RosterChange& change) {
  turned_away_.erase(change.robot);
  const auto known = robots_.find(change.robot);
  if (known == robots_.end()) return;  // was not listened to
  spdlog::warn("{}: has gone: {}", change.robot, change.reason);
  departures_.push_back({change.robot, change.reason, wall_clock_ns()});
  if (departures_.size() > kMostDepartures) departures_.pop_front();
  known->second.announced = false;
}

void Intake::come(const std::string& name) {
  if (robots_.count(name) == 0) {
    RobotConfig config;
    config.name = name;
    try {
      meet(name, config, false);
    } catch (const InputError& error) {
      robots_.erase(name);
      problems_.count(bus_name(robot_topic(node_.topics.depth, name)), "no_reader", error.what(),
                      1);
      return;
    }
  }
  robots_[name].announced = true;
  spdlog::info("{}: is on the bus", name);
}

void Intake::meet_those_turned_away() {
  while (!turned_away_.empty() && robots_.size() < kMostRobots) {
    const std::string name = *turned_away_.begin();
    turned_away_.erase(turned_away_.begin());
    come(name);
  }
}

void Intake::step(bool last) {
  if (tf_) tf_->drain_static(transforms_, problems_);
  const bool changed = follow_roster();
  const auto now = std::chrono::steady_clock::now();
  // A replay, which holds its senders back, has few robots and many reasons to go on.
  const bool everyone = last || changed || node_.lossless || now - swept_ >= kIdle;
  if (everyone) swept_ = now;
  const bool moved_any = tf_ && (tf_wakeup_.take() || everyone);
  std::vector<std::string> visited;
  for (auto& [name, robot] : robots_) {
    if (!(robot.wakeup->take() || everyone || (moved_any && robot.input->waits()))) continue;
    visited.push_back(name);
    const bool far_ahead = node_.lossless && merger_.pending(name) >= kMostBehind;
    robot.input->look(last        ? RobotInput::Turn::kLast
                      : far_ahead ? RobotInput::Turn::kHold
                                  : RobotInput::Turn::kUsual);
  }
  std::set<std::string> moved;
  if (moved_any) moved = tf_->drain(transforms_, problems_);
  for (const std::string& name : visited) {
    const auto robot = robots_.find(name);
    visit(name, *robot->second.input, moved);
    if (see_off(robot->second)) robots_.erase(robot);
  }
  hand_over(last);
  if (everyone) update_status();
}

void Intake::visit(const std::string& name, RobotInput& input, const std::set<std::string>& moved) {
  ++visits_;
  input.drain(moved);
  for (Frame& frame : input.take()) {
    const StampNs stamp_ns = frame.stamp_ns;
    merger_.add(name, stamp_ns, std::move(frame));
  }
  if (merger_.pending(name) >= kMostBehind) far_ahead_.insert(name);
  // A replay may be paused; who is silent on a live bus is not waited for.
  const bool silent = !node_.lossless && input.silent_s() >= node_.silent_wait_s;
  merger_.set_live(name, input.live() && !silent);
  merger_.set_watermark(name, input.watermark_ns());
}

bool Intake::see_off(const Robot& robot) {
  RobotInput& input = *robot.input;
  const auto frames = input.settle_departure();
  if (frames) transforms_.forget_moving(*frames);
  // The roster and the readers hear of a departure in either order.
  if (robot.named || robot.announced || input.live() || !input.settled()) return false;
  merger_.forget(input.name());
  departed_take_cpu_ms_ += input.take_cpu_ms();
  departed_frames_ += input.frames();
  departed_dropped_ += input.dropped();
  return true;
}

void Intake::hand_over(bool last) {
  while (last || !node_.lossless || queue_.has_room()) {
    for (auto name = far_ahead_.begin(); name != far_ahead_.end();) {
      name = merger_.pending(*name) < kMostBehind ? far_ahead_.erase(name) : std::next(name);
    }
    std::optional<Frame> frame = merger_.take(last || !far_ahead_.empty());
    if (!frame) return;
    if (node_.lossless || last) {
      queue_.push(std::move(*frame));
    } else {
      queue_.push_dropping(std::move(*frame));
    }
  }
}

void Intake::update_status() {
  IntakeStatus status;
  status.cpu_ms = thread_cpu_ms();
  status.take_cpu_ms = departed_take_cpu_ms_;
  status.visits = visits_;
  status.departed_frames = departed_frames_;
  status.departed_dropped = departed_dropped_;
  for (const auto& [name, robot] : robots_) {
    const RobotInput& input = *robot.input;
    status.take_cpu_ms += input.take_cpu_ms();
    std::string waiting = input.waiting_for();
    const double silent_s = input.silent_s();
    if (silent_s >= node_.silent_wait_s) {
      if (!waiting.empty()) waiting += "; ";
      waiting += "has sent no depth image for " + std::to_string(static_cast<long>(silent_s)) +
                 " s: the other robots do not wait for it";
    } else if (waiting.empty() && merger_.waits_for() == name) {
      waiting = "the other robots wait for its next frame";
    }
    status.robots.push_back({name, input.live(), input.frames(), input.dropped(), input.lost(),
                             std::move(waiting), input.images(), input.rate_limited(),
                             input.live() && silent_s >= node_.silent_wait_s});
  }
  status.departures.assign(departures_.begin(), departures_.end());
  status.problems = problems_.entries();
  const std::lock_guard<std::mutex> lock(status_mutex_);
  status_ = std::move(status);
}

IntakeStatus Intake::status() const {
  const std::lock_guard<std::mutex> lock(status_mutex_);
  return status_;
}

}  // namespace pocd::dds

#include "pocd_dds/node/status_publication.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>

#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/node/figures.hpp"

namespace pocd::dds {
namespace {

constexpr std::uint8_t kOk = 0, kWarning = 1, kError = 2;  // diagnostic_msgs/DiagnosticStatus

StampNs wall_clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

diagnostic_msgs::msg::DiagnosticStatus status_of(std::uint8_t level, const std::string& name,
                                                 const std::string& message) {
  diagnostic_msgs::msg::DiagnosticStatus status;
  status.level(level);
  status.name(name);
  status.message(message);
  status.hardware_id("pocd");
  return status;
}

void add(diagnostic_msgs::msg::DiagnosticStatus& status, const std::string& key,
         const std::string& value) {
  diagnostic_msgs::msg::KeyValue entry;
  entry.key(key);
  entry.value(value);
  status.values().push_back(entry);
}

std::string fixed(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

/// The node's instance in pocd/health: its epoch, which no other node has.
std::array<std::uint8_t, 16> node_key(std::uint64_t epoch) {
  return object_uuid(epoch, ObjectId::kNone);
}

/// One status for every robot that has gone and is not back.
void add_departed(const IntakeStatus& intake, const std::string& node,
                  diagnostic_msgs::msg::DiagnosticArray& diagnostics) {
  std::map<std::string, std::string> gone;
  for (const RobotDeparture& departure : intake.departures) gone[departure.name] = departure.reason;
  for (const RobotStatus& robot : intake.robots) gone.erase(robot.name);
  for (const auto& [name, reason] : gone) {
    diagnostics.status().push_back(status_of(kWarning, node + ": " + name, "has gone: " + reason));
  }
}

}  // namespace

StatusPublication::StatusPublication(const std::shared_ptr<Participant>& participant,
                                     std::string name, std::uint64_t epoch,
                                     const RosOutputConfig& outputs)
    : name_(std::move(name)), epoch_(epoch), health_(participant, topics::kHealth) {
  if (outputs.twins_hz > 0.0) {
    ros_health_ = std::make_unique<RenamedWriter<pocd_msgs::msg::NodeHealthPubSubType>>(
        participant, topics::kRosHealth,
        topics::in_namespace(topics::kRosHealth, outputs.topic_namespace));
  }
  if (outputs.diagnostics_hz <= 0.0) return;
  diagnostics_period_s_ = 1.0 / outputs.diagnostics_hz;
  diagnostics_ = std::make_unique<Writer<diagnostic_msgs::msg::DiagnosticArrayPubSubType>>(
      participant, topics::kDiagnostics);
}

pocd_msgs::msg::NodeHealth StatusPublication::send(const NodeReport& report, StampNs now_ns) {
  const IntakeStatus& intake = report.intake;
  const WorkStatus& work = report.work;
  const NodeState& state = report.state;
  pocd_msgs::msg::NodeHealth health;
  health.node(node_key(epoch_));
  health.stamp(to_time(wall_clock_ns()));
  health.name(name_);
  health.version(POCD_VERSION);
  health.epoch(epoch_);
  health.level(state.verdict.level);
  health.message(state.verdict.level >= kError ? state.verdict.why : state.word);
  health.ready(state.ready);
  health.still_s(state.still_s);
  const FrameSums frames = frame_sums(report);
  health.frames_received(frames.received);
  health.frames_processed(work.processed);
  health.frames_refused(work.refused);
  health.frames_dropped(frames.dropped);
  health.queue_length(static_cast<std::uint32_t>(report.queued));
  health.processing_ms(work.processing_ms);
  health.objects(static_cast<std::uint32_t>(work.objects));
  health.map_version(work.map.version);

  diagnostic_msgs::msg::DiagnosticArray diagnostics;
  diagnostics.header().stamp(to_time(now_ns));
  auto node =
      status_of(health.level(), name_, state.verdict.why.empty() ? state.word : state.verdict.why);
  for (const RobotStatus& robot : intake.robots) {
    pocd_msgs::msg::RobotHealth entry;
    entry.name(robot.name);
    entry.frames(robot.frames);
    entry.dropped(robot.dropped);
    entry.waiting_for(robot.waiting_for);
    entry.present(robot.live);
    health.robots().push_back(entry);

    const std::string message = !robot.live                 ? "no source of depth images"
                                : robot.waiting_for.empty() ? "ok"
                                                            : robot.waiting_for;
    auto status =
        status_of(robot.live && !robot.silent ? kOk : kWarning, name_ + ": " + robot.name, message);
    add(status, "frames", std::to_string(robot.frames));
    add(status, "frames dropped as incomplete", std::to_string(robot.dropped));
    add(status, "images lost on the bus", std::to_string(robot.lost));
    if (robot.rate_limited > 0) {
      add(status, "images beyond node.max_frame_rate_hz", std::to_string(robot.rate_limited));
    }
    diagnostics.status().push_back(status);
  }
  for (const RobotDeparture& departure : intake.departures) {
    pocd_msgs::msg::RobotDeparture entry;
    entry.name(departure.name);
    entry.reason(departure.reason);
    entry.stamp(to_time(departure.wall_ns));
    health.departures().push_back(entry);
  }
  add_departed(intake, name_, diagnostics);
  for (const ProblemCounter::Entry& entry : intake.problems) {
    pocd_msgs::msg::InputProblem problem;
    problem.topic(entry.topic);
    problem.reason(entry.reason);
    problem.count(entry.count);
    health.problems().push_back(problem);
    add(node, entry.topic + ": " + entry.reason, std::to_string(entry.count));
  }
  for (const Figure& figure : figures_of(report)) add(node, figure.key, figure.text);
  if (work.kept && !work.kept->problem.empty()) add(node, "memory problem", work.kept->problem);
  add(node, "map bytes per m2",
      fixed(work.map.area_m2 > 0 ? static_cast<double>(work.map.bytes) / work.map.area_m2 : 0.0));
  const std::uint64_t map_bytes = work.map.step_bytes + work.map.snapshot_bytes;
  const auto now = std::chrono::steady_clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - sent_).count();
  add(node, "map bytes per second", fixed(static_cast<double>(map_bytes - map_bytes_) / elapsed_s));
  map_bytes_ = map_bytes;
  sent_ = now;
  if (!work.last_warning.empty()) add(node, "last warning", work.last_warning);
  diagnostics.status().insert(diagnostics.status().begin(), node);
  health_.write(health);
  if (ros_health_) ros_health_->write(health);
  if (!diagnostics_) return health;
  // Health keeps its own rhythm of about a second, so the first one that is not much too early.
  const double since_s = std::chrono::duration<double>(now - diagnostics_sent_).count();
  if (since_s < diagnostics_period_s_ - 0.5 && state.word == "running") return health;
  diagnostics_sent_ = now;
  diagnostics_->write(diagnostics);
  return health;
}

}  // namespace pocd::dds

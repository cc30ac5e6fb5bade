#include "view/json_text.hpp"

#include <cmath>

#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/object_messages.hpp"

namespace pocd::view {
namespace {

/// Millimetres and thousandths are enough for eyes, and shorter.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

}  // namespace

std::string hex(const std::array<std::uint8_t, 16>& uuid) {
  static const char digits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : uuid) {
    text.push_back(digits[byte >> 4]);
    text.push_back(digits[byte & 15]);
  }
  return text;
}

std::string hex(std::uint64_t number) {
  std::array<std::uint8_t, 16> bytes{};
  for (int i = 0; i < 8; ++i) bytes[15 - i] = static_cast<std::uint8_t>(number >> (8 * i));
  return hex(bytes).substr(16);
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

double seconds(StampNs stamp_ns) { return static_cast<double>(stamp_ns) * 1e-9; }

Json box_json(const OrientedBox& box) {
  const Eigen::Vector3d& p = box.pose.position_W;
  return Json::array({rounded(p.x()), rounded(p.y()), rounded(p.z()), rounded(box.pose.yaw_rad),
                      rounded(box.size_m.x()), rounded(box.size_m.y()), rounded(box.size_m.z())});
}

Json belief_json(const Belief& belief) {
  return {{"v", rounded(belief.stationarity())},
          {"mu", rounded(belief.mu)},
          {"sigma", rounded(belief.sigma)},
          {"alpha", rounded(belief.alpha)},
          {"beta", rounded(belief.beta)}};
}

Json object_json(const WatchedObject& object, std::uint32_t run, const std::string& condition) {
  const ObjectSnapshot& state = object.state;
  return {{"type", "object"},
          {"id", hex(object.uuid)},
          {"run", run},
          {"number", to_index(state.id)},
          {"class", object.class_name},
          {"static", state.stationarity_class == 1},
          {"box", box_json(state.box)},
          {"belief", belief_json(state.belief)},
          {"first_seen", seconds(state.first_seen_ns)},
          {"last_seen", seconds(state.last_seen_ns)},
          {"observations", state.observations},
          {"robot", state.last_robot},
          {"seen_by", state.seen_by},
          {"condition", condition}};
}

Json event_json(const pocd_msgs::msg::ObjectEvent& message, std::uint64_t number,
                std::uint32_t run) {
  const ObjectEvent event = dds::event_from(message);
  const Evidence& evidence = event.evidence;
  Json json = {{"type", "event"},
               {"event", number},
               {"run", run},
               {"epoch", hex(message.epoch())},
               {"seq", event.sequence},
               {"kind", to_string(event.kind)},
               {"id", hex(message.uuid())},
               {"number", to_index(event.object)},
               {"class", message.class_name()},
               {"stamp", seconds(event.stamp_ns)},
               {"robot", event.robot},
               {"frame", event.frame_sequence},
               {"box", box_json(event.box)}};
  if (event.previous_box) json["previous"] = box_json(*event.previous_box);
  if (event.last_there_ns != 0) json["last_there"] = seconds(event.last_there_ns);
  if (event.first_gone_ns != 0) json["first_gone"] = seconds(event.first_gone_ns);
  if (!event.by.empty()) json["by"] = event.by;
  if (event.absorbed) json["absorbed"] = to_index(*event.absorbed);
  if (event.kind == EventKind::kAdded) json["arrival"] = to_string(event.arrival);
  json["evidence"] = {{"rule", evidence.rule},
                      {"delta", rounded(evidence.delta_m)},
                      {"sigma", rounded(evidence.measurement_sigma_m)},
                      {"static", evidence.stationarity_class == 1},
                      {"k", rounded(evidence.k)},
                      {"c1", rounded(evidence.c1)},
                      {"c2", rounded(evidence.c2)},
                      {"visible", rounded(evidence.visible_share)},
                      {"seen_through", rounded(evidence.seen_through_share)},
                      {"before", belief_json(evidence.before)},
                      {"after", belief_json(evidence.after)}};
  return json;
}

Json robot_json(const RobotPose& pose) {
  const Eigen::Vector3d& p = pose.position_W;
  const Eigen::Quaterniond& q = pose.rotation;
  return {{"type", "robot"},
          {"name", pose.name},
          {"stamp", seconds(pose.stamp_ns)},
          {"position", {rounded(p.x()), rounded(p.y()), rounded(p.z())}},
          {"rotation", {rounded(q.x()), rounded(q.y()), rounded(q.z()), rounded(q.w())}},
          {"view", pose.view}};
}

Json played_json(const std::string& kind, const std::string& name, double read,
                 const std::string& problem) {
  return {{"type", "status"},
          {"in_step", true},
          {"stale_because", ""},
          {"publisher_present", false},
          {"publisher_seen", true},
          {"ended", true},
          {"drawing", read < 1.0},
          {"played", {{"kind", kind}, {"name", name}, {"read", read}, {"problem", problem}}}};
}

Json health_json(const pocd_msgs::msg::NodeHealth& health, const std::string& condition) {
  Json robots = Json::array(), problems = Json::array(), departures = Json::array();
  for (const auto& robot : health.robots()) {
    robots.push_back({{"name", robot.name()},
                      {"frames", robot.frames()},
                      {"dropped", robot.dropped()},
                      {"waiting_for", robot.waiting_for()},
                      {"present", robot.present()}});
  }
  for (const auto& problem : health.problems()) {
    problems.push_back(
        {{"topic", problem.topic()}, {"reason", problem.reason()}, {"count", problem.count()}});
  }
  for (const auto& departure : health.departures()) {
    departures.push_back({{"name", departure.name()}, {"reason", departure.reason()}});
  }
  return {{"type", "health"},
          {"node", hex(health.node())},
          {"name", health.name()},
          {"version", health.version()},
          {"level", health.level()},
          {"message", health.message()},
          {"condition", condition},
          {"frames_processed", health.frames_processed()},
          {"frames_dropped", health.frames_dropped()},
          {"frames_refused", health.frames_refused()},
          {"queue", health.queue_length()},
          {"processing_ms", rounded(health.processing_ms())},
          {"robots", robots},
          {"departures", departures},
          {"problems", problems}};
}

Json sample_json(const ObjectSample& sample) {
  return {{"stamp", seconds(sample.stamp_ns)},
          {"box", box_json(sample.box)},
          {"belief", belief_json(sample.belief)},
          {"observations", sample.observations}};
}

Json record_json(const std::string& uuid, const History::Record& record) {
  Json samples = Json::array();
  for (const ObjectSample& sample : record.samples) {
    samples.push_back({seconds(sample.stamp_ns), rounded(sample.belief.stationarity()),
                       rounded(sample.belief.mu), rounded(sample.belief.sigma)});
  }
  Json json = {{"type", "history"},
               {"id", uuid},
               {"first_seen", seconds(record.first_ns)},
               {"samples", samples}};
  if (record.gone_ns) json["gone"] = seconds(*record.gone_ns);
  return json;
}

}  // namespace pocd::view

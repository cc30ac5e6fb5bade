#include "pocd_dds/bridge/object_messages.hpp"

#include "pocd_dds/bridge/geometry_messages.hpp"

namespace pocd::dds {
namespace {

pocd_msgs::msg::OrientedBox box_of(const OrientedBox& box) {
  pocd_msgs::msg::OrientedBox message;
  message.position(point_of(box.pose.position_W));
  message.yaw(box.pose.yaw_rad);
  message.size(vector_of(box.size_m));
  return message;
}

pocd_msgs::msg::Belief belief_of(const Belief& belief) {
  pocd_msgs::msg::Belief message;
  message.mu(belief.mu);
  message.sigma(belief.sigma);
  message.alpha(belief.alpha);
  message.beta(belief.beta);
  return message;
}

OrientedBox box_from(const pocd_msgs::msg::OrientedBox& message) {
  OrientedBox box;
  box.pose.position_W = {message.position().x(), message.position().y(), message.position().z()};
  box.pose.yaw_rad = message.yaw();
  box.size_m = {message.size().x(), message.size().y(), message.size().z()};
  return box;
}

Belief belief_from(const pocd_msgs::msg::Belief& message) {
  return Belief{message.mu(), message.sigma(), message.alpha(), message.beta()};
}

}  // namespace

std::array<std::uint8_t, 16> object_uuid(std::uint64_t lineage, ObjectId id) {
  std::array<std::uint8_t, 16> uuid{};
  const std::uint64_t number = to_index(id);
  for (int i = 0; i < 8; ++i) {
    uuid[i] = static_cast<std::uint8_t>(lineage >> (56 - 8 * i));
    uuid[8 + i] = static_cast<std::uint8_t>(number >> (56 - 8 * i));
  }
  return uuid;
}

pocd_msgs::msg::ObjectState object_message(const ObjectSnapshot& object, const MapRun& run,
                                           const ClassMap& classes, StampNs stamp_ns,
                                           const std::string& frame_id) {
  pocd_msgs::msg::ObjectState message;
  message.uuid(object_uuid(run.names(), object.id));
  message.header(header_of(stamp_ns, frame_id));
  message.map_id(run.map_id);
  message.epoch(run.epoch);
  message.lineage(run.names());
  message.local_id(to_index(object.id));
  message.class_id(object.class_id);
  message.class_name(classes.name(object.class_id));
  message.stationarity_class(static_cast<std::uint8_t>(object.stationarity_class));
  message.lifecycle(1);
  message.box(box_of(object.box));
  message.belief(belief_of(object.belief));
  message.stationarity(object.belief.stationarity());
  message.first_seen(to_time(object.first_seen_ns));
  message.last_seen(to_time(object.last_seen_ns));
  message.observations(object.observations);
  message.last_robot(object.last_robot);
  message.seen_by(object.seen_by);
  message.seen_in_run(object.seen_in_run);
  message.forgotten(object.forgotten);
  return message;
}

ObjectSnapshot object_from(const pocd_msgs::msg::ObjectState& message) {
  ObjectSnapshot object;
  object.id = static_cast<ObjectId>(message.local_id());
  object.class_id = message.class_id();
  object.stationarity_class = message.stationarity_class();
  object.box = box_from(message.box());
  object.belief = belief_from(message.belief());
  object.first_seen_ns = to_stamp(message.first_seen());
  object.last_seen_ns = to_stamp(message.last_seen());
  object.observations = message.observations();
  object.last_robot = message.last_robot();
  object.seen_by = message.seen_by();
  object.seen_in_run = message.seen_in_run();
  object.forgotten = message.forgotten();
  return object;
}

pocd_msgs::msg::ObjectEvent event_message(const ObjectEvent& event, const MapRun& run,
                                          const ClassMap& classes, const std::string& frame_id) {
  pocd_msgs::msg::ObjectEvent message;
  message.header(header_of(event.stamp_ns, frame_id));
  message.map_id(run.map_id);
  message.epoch(run.epoch);
  message.lineage(run.names());
  message.seq(event.sequence);
  message.kind(static_cast<std::uint8_t>(event.kind));
  message.uuid(object_uuid(run.names(), event.object));
  message.local_id(to_index(event.object));
  message.class_id(event.class_id);
  message.class_name(classes.name(event.class_id));
  message.frame_sequence(event.frame_sequence);
  message.robot(event.robot);
  message.box(box_of(event.box));
  message.has_previous_box(event.previous_box.has_value());
  if (event.previous_box) message.previous_box(box_of(*event.previous_box));
  if (event.absorbed) {
    message.absorbed_uuid(object_uuid(run.names(), *event.absorbed));
    message.absorbed_local_id(to_index(*event.absorbed));
  }
  message.arrival(static_cast<std::uint8_t>(event.arrival));
  pocd_msgs::msg::Evidence evidence;
  evidence.delta(event.evidence.delta_m);
  evidence.stationarity_class(static_cast<std::uint8_t>(event.evidence.stationarity_class));
  evidence.k(event.evidence.k);
  evidence.c1(event.evidence.c1);
  evidence.c2(event.evidence.c2);
  evidence.visible_share(event.evidence.visible_share);
  evidence.seen_through_share(event.evidence.seen_through_share);
  evidence.measurement_sigma(event.evidence.measurement_sigma_m);
  evidence.before(belief_of(event.evidence.before));
  evidence.after(belief_of(event.evidence.after));
  evidence.rule(event.evidence.rule);
  message.evidence(evidence);
  message.last_there(to_time(event.last_there_ns));
  message.first_gone(to_time(event.first_gone_ns));
  message.by(event.by);
  return message;
}

ObjectEvent event_from(const pocd_msgs::msg::ObjectEvent& message) {
  ObjectEvent event;
  event.sequence = message.seq();
  event.kind = static_cast<EventKind>(message.kind());
  event.object = static_cast<ObjectId>(message.local_id());
  event.class_id = message.class_id();
  event.stamp_ns = to_stamp(message.header().stamp());
  event.frame_sequence = message.frame_sequence();
  event.robot = message.robot();
  event.box = box_from(message.box());
  if (message.has_previous_box()) event.previous_box = box_from(message.previous_box());
  if (message.absorbed_local_id() != 0)
    event.absorbed = static_cast<ObjectId>(message.absorbed_local_id());
  // What a later program may call it is not known to this one.
  if (message.arrival() <= static_cast<std::uint8_t>(Arrival::kArrived))
    event.arrival = static_cast<Arrival>(message.arrival());
  const auto& evidence = message.evidence();
  event.evidence.delta_m = evidence.delta();
  event.evidence.stationarity_class = evidence.stationarity_class();
  event.evidence.k = evidence.k();
  event.evidence.c1 = evidence.c1();
  event.evidence.c2 = evidence.c2();
  event.evidence.visible_share = evidence.visible_share();
  event.evidence.seen_through_share = evidence.seen_through_share();
  event.evidence.measurement_sigma_m = evidence.measurement_sigma();
  event.evidence.before = belief_from(evidence.before());
  event.evidence.after = belief_from(evidence.after());
  event.evidence.rule = evidence.rule();
  event.last_there_ns = to_stamp(message.last_there());
  event.first_gone_ns = to_stamp(message.first_gone());
  event.by = message.by();
  return event;
}

}  // namespace pocd::dds

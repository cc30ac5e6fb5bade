#include <algorithm>
#include <boost/crc.hpp>

#include "pocd/common/check.hpp"
#include "pocd_dds/bridge/conversions.hpp"

namespace pocd::dds {
namespace {

constexpr std::size_t kKeyBytes = 12;  // of a tile, on the wire

std_msgs::msg::Header header_of(StampNs stamp_ns, const std::string& frame_id) {
  std_msgs::msg::Header header;
  header.stamp(to_time(stamp_ns));
  header.frame_id(frame_id);
  return header;
}

geometry_msgs::msg::Point point_of(const Eigen::Vector3d& p) {
  geometry_msgs::msg::Point point;
  point.x(p.x()), point.y(p.y()), point.z(p.z());
  return point;
}

geometry_msgs::msg::Quaternion quaternion_of(const Eigen::Quaterniond& q) {
  geometry_msgs::msg::Quaternion quaternion;
  quaternion.x(q.x()), quaternion.y(q.y()), quaternion.z(q.z()), quaternion.w(q.w());
  return quaternion;
}

geometry_msgs::msg::Vector3 vector_of(const Eigen::Vector3d& v) {
  geometry_msgs::msg::Vector3 vector;
  vector.x(v.x()), vector.y(v.y()), vector.z(v.z());
  return vector;
}

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

pocd_msgs::msg::TileKey key_of(const TileKey& key) {
  pocd_msgs::msg::TileKey message;
  message.x(key.x), message.y(key.y), message.z(key.z);
  return message;
}

std::uint32_t crc_of(const std::vector<std::uint8_t>& payload) {
  boost::crc_32_type crc;
  crc.process_bytes(payload.data(), payload.size());
  return crc.checksum();
}

pocd_msgs::msg::TileData data_of(const MapTile& tile) {
  pocd_msgs::msg::TileData data;
  data.key(key_of(tile.key));
  data.version(tile.version);
  data.crc(crc_of(tile.payload));
  data.payload(tile.payload);
  return data;
}

template <class Message>
void number_parts(std::vector<Message>& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i].part(static_cast<std::uint32_t>(i));
    parts[i].part_count(static_cast<std::uint32_t>(parts.size()));
  }
}

/// Appends `tiles` to the last message of `parts`, which holds `bytes` already, opening a new one
/// (a copy of `empty`) when full.
template <class Message, class Tiles>
void append_tiles(std::vector<Message>& parts, const Message& empty, const Tiles& tiles,
                  std::size_t part_bytes, std::size_t bytes) {
  for (const MapTile* tile : tiles) {
    if (bytes > 0 && bytes + tile->payload.size() > part_bytes) {
      parts.push_back(empty);
      bytes = 0;
    }
    parts.back().changed().push_back(data_of(*tile));
    bytes += tile->payload.size();
  }
}

}  // namespace

sensor_msgs::msg::Image image_message(const cv::Mat& image, const std::string& encoding,
                                      StampNs stamp_ns, const std::string& frame_id) {
  POCD_CHECK(!image.empty());
  sensor_msgs::msg::Image message;
  message.header(header_of(stamp_ns, frame_id));
  message.height(static_cast<std::uint32_t>(image.rows));
  message.width(static_cast<std::uint32_t>(image.cols));
  message.encoding(encoding);
  const std::size_t row_bytes = static_cast<std::size_t>(image.cols) * image.elemSize();
  message.step(static_cast<std::uint32_t>(row_bytes));
  message.data().resize(row_bytes * static_cast<std::size_t>(image.rows));
  for (int row = 0; row < image.rows; ++row) {
    std::copy_n(image.ptr<std::uint8_t>(row), row_bytes, message.data().data() + row * row_bytes);
  }
  return message;
}

sensor_msgs::msg::CameraInfo camera_message(const CameraModel& camera, StampNs stamp_ns,
                                            const std::string& frame_id) {
  sensor_msgs::msg::CameraInfo message;
  message.header(header_of(stamp_ns, frame_id));
  message.height(static_cast<std::uint32_t>(camera.height));
  message.width(static_cast<std::uint32_t>(camera.width));
  message.distortion_model("plumb_bob");
  message.d(std::vector<double>(5, 0.0));
  message.k({camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1});
  message.r({1, 0, 0, 0, 1, 0, 0, 0, 1});
  message.p({camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0});
  return message;
}

nav_msgs::msg::Odometry odometry_message(const StampedTransform& transform) {
  nav_msgs::msg::Odometry message;
  message.header(header_of(transform.stamp_ns, transform.parent));
  message.child_frame_id(transform.child);
  message.pose().pose().position(point_of(transform.T.position));
  message.pose().pose().orientation(quaternion_of(transform.T.rotation));
  return message;
}

geometry_msgs::msg::TransformStamped transform_message(const StampedTransform& transform) {
  geometry_msgs::msg::TransformStamped message;
  message.header(header_of(transform.stamp_ns, transform.parent));
  message.child_frame_id(transform.child);
  message.transform().translation(vector_of(transform.T.position));
  message.transform().rotation(quaternion_of(transform.T.rotation));
  return message;
}

std::array<std::uint8_t, 16> object_uuid(std::uint64_t epoch, ObjectId id) {
  std::array<std::uint8_t, 16> uuid{};
  const std::uint64_t number = to_index(id);
  for (int i = 0; i < 8; ++i) {
    uuid[i] = static_cast<std::uint8_t>(epoch >> (56 - 8 * i));
    uuid[8 + i] = static_cast<std::uint8_t>(number >> (56 - 8 * i));
  }
  return uuid;
}

pocd_msgs::msg::ObjectState object_message(const ObjectSnapshot& object, const MapRun& run,
                                           const ClassMap& classes, StampNs stamp_ns,
                                           const std::string& frame_id) {
  pocd_msgs::msg::ObjectState message;
  message.uuid(object_uuid(run.epoch, object.id));
  message.header(header_of(stamp_ns, frame_id));
  message.map_id(run.map_id);
  message.epoch(run.epoch);
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
  return object;
}

pocd_msgs::msg::ObjectEvent event_message(const ObjectEvent& event, const MapRun& run,
                                          const ClassMap& classes, const std::string& frame_id) {
  pocd_msgs::msg::ObjectEvent message;
  message.header(header_of(event.stamp_ns, frame_id));
  message.map_id(run.map_id);
  message.epoch(run.epoch);
  message.seq(event.sequence);
  message.kind(static_cast<std::uint8_t>(event.kind));
  message.uuid(object_uuid(run.epoch, event.object));
  message.local_id(to_index(event.object));
  message.class_id(event.class_id);
  message.class_name(classes.name(event.class_id));
  message.frame_sequence(event.frame_sequence);
  message.robot(event.robot);
  message.box(box_of(event.box));
  message.has_previous_box(event.previous_box.has_value());
  if (event.previous_box) message.previous_box(box_of(*event.previous_box));
  if (event.absorbed) {
    message.absorbed_uuid(object_uuid(run.epoch, *event.absorbed));
    message.absorbed_local_id(to_index(*event.absorbed));
  }
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
  return event;
}

pocd_msgs::msg::MapTile tile_message(const MapTile& tile, std::uint32_t map_id,
                                     std::uint64_t epoch) {
  pocd_msgs::msg::MapTile message;
  message.map_id(map_id);
  message.x(tile.key.x), message.y(tile.key.y), message.z(tile.key.z);
  message.epoch(epoch);
  message.version(tile.version);
  message.crc(crc_of(tile.payload));
  message.payload(tile.payload);
  return message;
}

std::optional<MapTile> tile_from(const pocd_msgs::msg::MapTile& message) {
  if (crc_of(message.payload()) != message.crc()) return std::nullopt;
  return MapTile{{message.x(), message.y(), message.z()}, message.version(), message.payload()};
}

std::optional<MapTile> tile_from(const pocd_msgs::msg::TileData& data) {
  if (crc_of(data.payload()) != data.crc()) return std::nullopt;
  return MapTile{key_from(data.key()), data.version(), data.payload()};
}

std::vector<pocd_msgs::msg::MapDelta> delta_messages(const MapDelta& delta, std::uint32_t map_id,
                                                     StampNs stamp_ns, std::size_t part_bytes) {
  pocd_msgs::msg::MapDelta empty;
  empty.map_id(map_id);
  empty.epoch(delta.epoch);
  empty.base_version(delta.base_version);
  empty.version(delta.version);
  empty.stamp(to_time(stamp_ns));
  empty.digest(digest_message(delta.digest));
  std::vector<pocd_msgs::msg::MapDelta> parts{empty};
  const std::size_t most_keys = part_bytes / kKeyBytes;
  for (const TileKey& key : delta.removed) {
    if (parts.back().removed().size() == most_keys) parts.push_back(empty);
    parts.back().removed().push_back(key_of(key));
  }
  std::vector<const MapTile*> tiles;
  for (const MapTile& tile : delta.changed) tiles.push_back(&tile);
  append_tiles(parts, empty, tiles, part_bytes, parts.back().removed().size() * kKeyBytes);
  number_parts(parts);
  return parts;
}

std::optional<MapDelta> delta_from(const std::vector<pocd_msgs::msg::MapDelta>& parts) {
  POCD_CHECK(!parts.empty());
  MapDelta delta;
  delta.epoch = parts.front().epoch();
  delta.base_version = parts.front().base_version();
  delta.version = parts.front().version();
  delta.digest = digest_from(parts.front().digest());
  for (const auto& part : parts) {
    for (const auto& key : part.removed()) delta.removed.push_back(key_from(key));
    for (const auto& data : part.changed()) {
      std::optional<MapTile> tile = tile_from(data);
      if (!tile) return std::nullopt;
      delta.changed.push_back(std::move(*tile));
    }
  }
  return delta;
}

std::vector<pocd_msgs::msg::MapSnapshotReply> snapshot_messages(const MapPublisher& publisher,
                                                                std::uint64_t base_version,
                                                                std::uint32_t map_id,
                                                                std::size_t part_bytes) {
  pocd_msgs::msg::MapSnapshotReply empty;
  empty.map_id(map_id);
  empty.epoch(publisher.epoch());
  empty.base_version(base_version);
  empty.version(publisher.version());
  empty.digest(digest_message(publisher.digest()));
  std::vector<pocd_msgs::msg::MapSnapshotReply> parts{empty};
  std::vector<const MapTile*> tiles;
  const std::size_t most_keys = part_bytes / kKeyBytes;
  for (const auto& [key, tile] : publisher.tiles()) {
    if (parts.back().present().size() == most_keys) parts.push_back(empty);
    parts.back().present().push_back(key_of(key));
    if (tile.version > base_version) tiles.push_back(&tile);
  }
  append_tiles(parts, empty, tiles, part_bytes, parts.back().present().size() * kKeyBytes);
  number_parts(parts);
  return parts;
}

MapSnapshot snapshot_header(const pocd_msgs::msg::MapSnapshotReply& message) {
  MapSnapshot snapshot;
  snapshot.epoch = message.epoch();
  snapshot.base_version = message.base_version();
  snapshot.version = message.version();
  snapshot.digest = digest_from(message.digest());
  return snapshot;
}

std::optional<MapSnapshot> snapshot_from(
    const std::vector<pocd_msgs::msg::MapSnapshotReply>& parts) {
  POCD_CHECK(!parts.empty());
  MapSnapshot snapshot = snapshot_header(parts.front());
  for (const auto& part : parts) {
    for (const auto& key : part.present()) snapshot.present.push_back(key_from(key));
    for (const auto& data : part.changed()) {
      std::optional<MapTile> tile = tile_from(data);
      if (!tile) return std::nullopt;
      snapshot.changed.push_back(std::move(*tile));
    }
  }
  return snapshot;
}

TileKey key_from(const pocd_msgs::msg::TileKey& key) { return {key.x(), key.y(), key.z()}; }

MapDigest digest_from(const pocd_msgs::msg::MapDigest& digest) {
  MapDigest result;
  result.low = digest.low();
  result.high = digest.high();
  return result;
}

pocd_msgs::msg::MapDigest digest_message(const MapDigest& digest) {
  pocd_msgs::msg::MapDigest message;
  message.low(digest.low);
  message.high(digest.high);
  return message;
}

}  // namespace pocd::dds

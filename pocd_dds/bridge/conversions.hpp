// Between messages and the core's types: the only place that knows both.
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "geometry_msgs.h"
#include "nav_msgs.h"
#include "pocd/input/message_checks.hpp"
#include "pocd/map/map_follower.hpp"
#include "pocd/pipeline/frame_result.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_msgs.h"
#include "sensor_msgs.h"
#include "tf2_msgs.h"

namespace pocd::dds {

StampNs to_stamp(const builtin_interfaces::msg::Time& time);
builtin_interfaces::msg::Time to_time(StampNs stamp_ns);

// ---- input: pocd/input/message_checks.hpp says what is accepted; images: image_visit.hpp ----

Checked<CameraModel> camera_from(const sensor_msgs::msg::CameraInfo& info);

Checked<StampedTransform> transform_from(const nav_msgs::msg::Odometry& odometry);
Checked<StampedTransform> transform_from(const geometry_msgs::msg::TransformStamped& transform);

// ---- what pocd_play sends ----

sensor_msgs::msg::Image image_message(const cv::Mat& image, const std::string& encoding,
                                      StampNs stamp_ns, const std::string& frame_id);
sensor_msgs::msg::CameraInfo camera_message(const CameraModel& camera, StampNs stamp_ns,
                                            const std::string& frame_id);
nav_msgs::msg::Odometry odometry_message(const StampedTransform& transform);
geometry_msgs::msg::TransformStamped transform_message(const StampedTransform& transform);

// ---- output ----

/// The map that a message is about, and the run of the node that says it.
struct MapRun {
  std::uint32_t map_id = 0;
  std::uint64_t epoch = 0;
};

/// Eight bytes of epoch and eight of the id, most significant first: never the same in two epochs.
std::array<std::uint8_t, 16> object_uuid(std::uint64_t epoch, ObjectId id);

pocd_msgs::msg::ObjectState object_message(const ObjectSnapshot& object, const MapRun& run,
                                           const ClassMap& classes, StampNs stamp_ns,
                                           const std::string& frame_id);
ObjectSnapshot object_from(const pocd_msgs::msg::ObjectState& message);
pocd_msgs::msg::ObjectEvent event_message(const ObjectEvent& event, const MapRun& run,
                                          const ClassMap& classes, const std::string& frame_id);
ObjectEvent event_from(const pocd_msgs::msg::ObjectEvent& message);

pocd_msgs::msg::MapTile tile_message(const MapTile& tile, std::uint32_t map_id,
                                     std::uint64_t epoch);
/// CRC of the payload does not fit it: nothing.
std::optional<MapTile> tile_from(const pocd_msgs::msg::MapTile& message);

/// One step cut into messages of at most about `part_bytes` of payload each.
std::vector<pocd_msgs::msg::MapDelta> delta_messages(const MapDelta& delta, std::uint32_t map_id,
                                                     StampNs stamp_ns, std::size_t part_bytes);
/// The step that all its parts (in order, complete) make; nothing when a CRC does not fit.
std::optional<MapDelta> delta_from(const std::vector<pocd_msgs::msg::MapDelta>& parts);

/// Every tile newer than `base_version` and the keys of all, cut like a delta.
std::vector<pocd_msgs::msg::MapSnapshotReply> snapshot_messages(const MapPublisher& publisher,
                                                                std::uint64_t base_version,
                                                                std::uint32_t map_id,
                                                                std::size_t part_bytes);
/// Without tiles and keys.
MapSnapshot snapshot_header(const pocd_msgs::msg::MapSnapshotReply& message);
/// What all parts (in order, complete) make; nothing when a CRC does not fit.
std::optional<MapSnapshot> snapshot_from(
    const std::vector<pocd_msgs::msg::MapSnapshotReply>& parts);

TileKey key_from(const pocd_msgs::msg::TileKey& key);
std::optional<MapTile> tile_from(const pocd_msgs::msg::TileData& data);
MapDigest digest_from(const pocd_msgs::msg::MapDigest& digest);
pocd_msgs::msg::MapDigest digest_message(const MapDigest& digest);

}  // namespace pocd::dds

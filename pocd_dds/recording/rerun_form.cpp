#include "pocd_dds/recording/rerun_form.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "nav_msgsPubSubTypes.h"
#include "pocd_dds/entities/guarded_type.hpp"
#include "pocd_dds/entities/topic_table.hpp"
#include "sensor_msgsPubSubTypes.h"
#include "tf2_msgsPubSubTypes.h"
#include "visualization_msgsPubSubTypes.h"

namespace pocd::dds {
namespace {

using eprosima::fastrtps::rtps::SerializedPayload_t;
using recording::Bytes;
using sensor_msgs::msg::PointCloud2;
using visualization_msgs::msg::Marker;

constexpr std::uint8_t kUint32 = 6, kFloat32 = 7;                   // sensor_msgs/PointField
constexpr std::int32_t kCube = 1, kAdd = 0, kDelete = 2, kAll = 3;  // visualization_msgs/Marker
constexpr double kRadius_m = 0.02;                                  // of an edge
constexpr double kStep_m = 0.02;                                    // of points along an edge,
constexpr int kMostSteps = 100;                                     // but no more than that
constexpr std::size_t kMostBoxes = 20000;
constexpr std::size_t kMostPoints =
    200000;  // of all edges together: of many boxes they are thinner

template <class PubSubType>
std::optional<typename PubSubType::type> decoded(const Bytes& bytes) {
  SerializedPayload_t payload;
  payload.data = const_cast<std::uint8_t*>(bytes.data());
  payload.length = payload.max_size = static_cast<std::uint32_t>(bytes.size());
  typename PubSubType::type message;
  const bool good = bytes.size() >= 4 && GuardedType<PubSubType>().deserialize(&payload, &message);
  payload.data = nullptr;  // not its own
  if (!good) return std::nullopt;
  return message;
}

template <class PubSubType>
Bytes encoded(typename PubSubType::type& message) {
  PubSubType type;
  SerializedPayload_t payload(type.getSerializedSizeProvider(&message)());
  if (!type.serialize(&message, &payload)) return {};
  return Bytes(payload.data, payload.data + payload.length);
}

std::uint32_t rgba(std::uint32_t rgb) { return rgb << 8 | 0xFF; }

std::uint32_t colour_of(const Marker& marker) {
  const auto part = [](float value) {
    return static_cast<std::uint32_t>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f)));
  };
  return rgba(part(marker.color().r()) << 16 | part(marker.color().g()) << 8 |
              part(marker.color().b()));
}

void add_field(PointCloud2& cloud, const char* name, std::uint32_t offset, std::uint8_t type) {
  sensor_msgs::msg::PointField field;
  field.name(name);
  field.offset(offset);
  field.datatype(type);
  field.count(1);
  cloud.fields().push_back(field);
}

/// With "colors" behind the other fields of each point.
bool colour(PointCloud2& cloud) {
  const auto& fields = cloud.fields();
  const auto named = [&](const char* name) {
    return std::find_if(fields.begin(), fields.end(),
                        [&](const auto& field) { return field.name() == name; });
  };
  const auto rgb = named("rgb");
  const std::size_t step = cloud.point_step(), offset = rgb == fields.end() ? 0 : rgb->offset();
  if (rgb == fields.end() || named("colors") != fields.end() || cloud.is_bigendian() ||
      step < offset + 4 || step > 4096) {
    return false;
  }
  const std::size_t count = cloud.data().size() / step;
  std::vector<std::uint8_t> data;
  data.reserve(count * (step + 4));
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* point = cloud.data().data() + i * step;
    std::uint32_t from = 0;
    std::memcpy(&from, point + offset, 4);
    const std::uint32_t to = rgba(from);
    data.insert(data.end(), point, point + step);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&to);
    data.insert(data.end(), bytes, bytes + 4);
  }
  add_field(cloud, "colors", static_cast<std::uint32_t>(step), kUint32);
  cloud.point_step(static_cast<std::uint32_t>(step + 4));
  cloud.height(1);
  cloud.width(static_cast<std::uint32_t>(count));
  cloud.row_step(static_cast<std::uint32_t>(data.size()));
  cloud.data(std::move(data));
  return true;
}

struct EdgePoint {
  float x, y, z;
  std::uint32_t colors;
  float radii;
};
static_assert(sizeof(EdgePoint) == 20);

std::string marker_type(std::int32_t type) {
  static const char* const names[] = {"arrow",  "cube",  "sphere", "cylinder",
                                      "lines",  "lines", "cubes",  "spheres",
                                      "points", "text",  "mesh",   "triangles"};
  const bool known = type >= 0 && type < static_cast<std::int32_t>(std::size(names));
  return "markers of type " + std::to_string(type) +
         (known ? " (" + std::string(names[type]) + ")" : "");
}

/// False, and nothing: its place or size is no number.
bool add_edges(const Marker& box, int most_steps, std::vector<EdgePoint>& points) {
  const auto& at = box.pose().position();
  const auto& turn = box.pose().orientation();
  const Eigen::Vector3d centre(at.x(), at.y(), at.z());
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond(turn.w(), turn.x(), turn.y(), turn.z()).normalized();
  const Eigen::Vector3d half =
      0.5 * Eigen::Vector3d(box.scale().x(), box.scale().y(), box.scale().z());
  if (!centre.allFinite() || !rotation.coeffs().allFinite() || !half.allFinite()) return false;
  const std::uint32_t colors = colour_of(box);
  for (int along = 0; along < 3; ++along) {
    const double length = 2.0 * std::abs(half[along]);
    const int steps = std::clamp(static_cast<int>(std::min(length / kStep_m, 1e6)), 1, most_steps);
    const auto radius =
        static_cast<float>(std::min(std::max(kRadius_m, 0.6 * length / steps), 0.05));
    for (const int side : {-1, 1}) {
      for (const int other : {-1, 1}) {
        for (int i = 0; i <= steps; ++i) {
          Eigen::Vector3d p;
          p[along] = half[along] * (2.0 * i / steps - 1.0);
          p[(along + 1) % 3] = side * half[(along + 1) % 3];
          p[(along + 2) % 3] = other * half[(along + 2) % 3];
          const Eigen::Vector3f q = (centre + rotation * p).cast<float>();
          points.push_back({q.x(), q.y(), q.z(), colors, radius});
        }
      }
    }
  }
  return true;
}

}  // namespace

std::optional<RerunForm> RerunForm::of(const RecordedTopic& topic) {
  if (topic.type == topics::kSurface.type) return RerunForm(Kind::kCloud);
  if (topic.type == topics::kMarkers.type) return RerunForm(Kind::kMarkers);
  if (topic.type == topics::kOdometry.type) return RerunForm(Kind::kOdometry);
  return std::nullopt;
}

std::optional<recording::SchemaText> RerunForm::second() const {
  if (kind_ == Kind::kCloud) return std::nullopt;
  RecordedTopic topic;
  topic.type = kind_ == Kind::kMarkers ? topics::kSurface.type : topics::kTf.type;
  return schema_of(topic);
}

std::string RerunForm::second_name(const RecordedTopic& topic) {
  return recorded_name(topic.name) + "/rerun";
}

Bytes RerunForm::edges(const visualization_msgs::msg::MarkerArray& array) {
  PointCloud2 cloud;
  for (const Marker& marker : array.markers()) {
    const std::pair name(marker.ns(), marker.id());
    if (marker.action() == kAll) boxes_.clear();
    if (marker.action() == kDelete) boxes_.erase(name);
    if (marker.action() != kAdd) continue;
    if (marker.type() != kCube) {
      boxes_.erase(name);
      ++left_out_[marker_type(marker.type())];
    } else if (boxes_.size() < kMostBoxes || boxes_.count(name) > 0) {
      boxes_[name] = marker;
    } else {
      ++left_out_["boxes beyond " + std::to_string(kMostBoxes)];
    }
  }
  if (array.markers().empty()) return {};
  cloud.header(array.markers().back().header());
  std::vector<EdgePoint> points;
  const int room = static_cast<int>(kMostPoints / (12 * std::max<std::size_t>(boxes_.size(), 1)));
  const int most_steps = std::clamp(room - 1, 1, kMostSteps);
  for (const auto& [name, box] : boxes_) {
    if (box.header().frame_id() != cloud.header().frame_id()) {
      ++left_out_["boxes in another frame than the last marker of a message"];
    } else if (!add_edges(box, most_steps, points)) {
      ++left_out_["boxes whose place or size is no number"];
    }
  }
  add_field(cloud, "x", offsetof(EdgePoint, x), kFloat32);
  add_field(cloud, "y", offsetof(EdgePoint, y), kFloat32);
  add_field(cloud, "z", offsetof(EdgePoint, z), kFloat32);
  add_field(cloud, "colors", offsetof(EdgePoint, colors), kUint32);
  add_field(cloud, "radii", offsetof(EdgePoint, radii), kFloat32);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(points.data());
  cloud.height(1);
  cloud.width(static_cast<std::uint32_t>(points.size()));
  cloud.point_step(sizeof(EdgePoint));
  cloud.row_step(static_cast<std::uint32_t>(points.size() * sizeof(EdgePoint)));
  cloud.data(std::vector<std::uint8_t>(bytes, bytes + points.size() * sizeof(EdgePoint)));
  cloud.is_dense(true);
  return encoded<sensor_msgs::msg::PointCloud2PubSubType>(cloud);
}

std::optional<Bytes> RerunForm::convert(const Bytes& message) {
  Bytes made;
  if (kind_ == Kind::kCloud) {
    auto cloud = decoded<sensor_msgs::msg::PointCloud2PubSubType>(message);
    if (cloud && colour(*cloud)) made = encoded<sensor_msgs::msg::PointCloud2PubSubType>(*cloud);
  } else if (kind_ == Kind::kMarkers) {
    const auto array = decoded<visualization_msgs::msg::MarkerArrayPubSubType>(message);
    if (!array) ++left_out_["damaged messages"];
    if (array) made = edges(*array);
  } else if (const auto odometry = decoded<nav_msgs::msg::OdometryPubSubType>(message)) {
    geometry_msgs::msg::TransformStamped transform;
    transform.header(odometry->header());
    transform.child_frame_id(odometry->child_frame_id());
    const auto& at = odometry->pose().pose().position();
    transform.transform().translation().x(at.x());
    transform.transform().translation().y(at.y());
    transform.transform().translation().z(at.z());
    transform.transform().rotation(odometry->pose().pose().orientation());
    tf2_msgs::msg::TFMessage tf;
    tf.transforms().push_back(std::move(transform));
    made = encoded<tf2_msgs::msg::TFMessagePubSubType>(tf);
  }
  if (made.empty()) return std::nullopt;
  return made;
}

}  // namespace pocd::dds

#include "pocd_dds/bridge/ros_messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "pocd_dds/bridge/geometry_messages.hpp"

namespace pocd::dds {
namespace {

constexpr std::int32_t kCube = 1, kAdd = 0, kDelete = 2,
                       kDeleteAll = 3;                          // visualization_msgs/Marker
constexpr std::int32_t kObstacleAdd = 1;                        // rmf_obstacle_msgs/Obstacle
constexpr std::uint8_t kUint16 = 4, kUint32 = 6, kFloat32 = 7;  // sensor_msgs/PointField

geometry_msgs::msg::Pose pose_of(const OrientedBox& box) {
  geometry_msgs::msg::Pose pose;
  pose.position(point_of(box.pose.position_W));
  pose.orientation().z(std::sin(box.pose.yaw_rad / 2));
  pose.orientation().w(std::cos(box.pose.yaw_rad / 2));
  return pose;
}

std::int32_t number_of(ObjectId id) { return static_cast<std::int32_t>(to_index(id)); }

}  // namespace

std::vector<ObjectId> Departures::update(const ObjectsById& present) {
  for (const ObjectId id : present_) {
    if (present.count(id) == 0) gone_.emplace(id, kTimes);
  }
  present_.clear();
  for (const auto& [id, object] : present) {
    present_.insert(id);
    gone_.erase(id);
  }
  std::vector<ObjectId> say;
  for (auto entry = gone_.begin(); entry != gone_.end();) {
    say.push_back(entry->first);
    entry = --entry->second == 0 ? gone_.erase(entry) : std::next(entry);
  }
  return say;
}

visualization_msgs::msg::MarkerArray marker_array(const ObjectsById& objects,
                                                  const std::vector<ObjectId>& gone, bool first,
                                                  StampNs stamp_ns, const std::string& frame_id) {
  visualization_msgs::msg::MarkerArray array;
  const auto push = [&](std::int32_t action, std::int32_t id) -> visualization_msgs::msg::Marker& {
    visualization_msgs::msg::Marker& marker = array.markers().emplace_back();
    marker.header(header_of(stamp_ns, frame_id));
    marker.ns("pocd");
    marker.id(id);
    marker.action(action);
    marker.pose().orientation().w(1.0);
    return marker;
  };
  if (first) push(kDeleteAll, 0);
  for (const ObjectId id : gone) push(kDelete, number_of(id));
  for (const auto& [id, object] : objects) {
    visualization_msgs::msg::Marker& marker = push(kAdd, number_of(id));
    marker.type(kCube);
    marker.pose(pose_of(object.box));
    marker.scale(vector_of(object.box.size_m));
    const auto stationarity = static_cast<float>(object.belief.stationarity());
    marker.color().r(1.0f - stationarity);
    marker.color().g(stationarity);
    marker.color().b(0.2f);
    if (object.seen_in_run) {
      marker.color().a(0.6f);
    } else {  // known from before, and not looked at since
      marker.color().r(0.5f);
      marker.color().g(0.5f);
      marker.color().b(0.5f);
      marker.color().a(0.3f);
    }
  }
  return array;
}

rmf_obstacle_msgs::msg::Obstacles obstacles_message(const ObjectsById& objects,
                                                    const ClassMap& classes,
                                                    const ObstacleOptions& options, StampNs now_ns,
                                                    const std::string& frame_id) {
  rmf_obstacle_msgs::msg::Obstacles message;
  message.header(header_of(now_ns, frame_id));
  const auto whole_s = static_cast<std::int32_t>(options.lifetime_s);
  for (const auto& [id, object] : objects) {
    rmf_obstacle_msgs::msg::Obstacle& obstacle = message.obstacles().emplace_back();
    obstacle.header(message.header());
    obstacle.id(number_of(id));
    obstacle.source(options.source);
    obstacle.level_name(options.level_name);
    obstacle.classification(classes.name(object.class_id));
    obstacle.bbox().center(pose_of(object.box));
    obstacle.bbox().size(vector_of(object.box.size_m));
    obstacle.lifetime().sec(whole_s);
    obstacle.lifetime().nanosec(
        static_cast<std::uint32_t>(std::llround((options.lifetime_s - whole_s) * 1e9)));
    obstacle.action(kObstacleAdd);
  }
  return message;
}

nav_msgs::msg::OccupancyGrid grid_message(const CellRectangle& grid, double resolution_m,
                                          StampNs stamp_ns, const std::string& frame_id) {
  nav_msgs::msg::OccupancyGrid message;
  message.header(header_of(stamp_ns, frame_id));
  message.info().map_load_time(to_time(stamp_ns));
  message.info().resolution(static_cast<float>(resolution_m));
  message.info().width(grid.width);
  message.info().height(grid.height);
  // A multiple of the resolution as it is sent: Nav2 asks for it.
  const double sent_m = message.info().resolution();
  message.info().origin().position().x(grid.x * sent_m);
  message.info().origin().position().y(grid.y * sent_m);
  message.info().origin().orientation().w(1.0);
  message.data().assign(grid.cells.begin(), grid.cells.end());
  return message;
}

map_msgs::msg::OccupancyGridUpdate grid_update_message(const CellRectangle& changed,
                                                       StampNs stamp_ns,
                                                       const std::string& frame_id) {
  map_msgs::msg::OccupancyGridUpdate message;
  message.header(header_of(stamp_ns, frame_id));
  message.x(changed.x);
  message.y(changed.y);
  message.width(changed.width);
  message.height(changed.height);
  message.data().assign(changed.cells.begin(), changed.cells.end());
  return message;
}

sensor_msgs::msg::PointCloud2 cloud_message(const SurfacePoints& surface,
                                            const AppearanceOf& appearance, std::size_t most_points,
                                            StampNs stamp_ns, const std::string& frame_id) {
  // In memory as on the wire: the message says that it is little-endian.
  struct Point {
    float x, y, z;
    std::uint32_t rgb;
    std::uint16_t class_id, unused;
    std::uint32_t object;
  };
  static_assert(sizeof(Point) == 24);
  sensor_msgs::msg::PointCloud2 cloud;
  cloud.header(header_of(stamp_ns, frame_id));
  const auto field = [&](const char* name, std::size_t offset, std::uint8_t type) {
    sensor_msgs::msg::PointField& entry = cloud.fields().emplace_back();
    entry.name(name);
    entry.offset(static_cast<std::uint32_t>(offset));
    entry.datatype(type);
    entry.count(1);
  };
  field("x", offsetof(Point, x), kFloat32);
  field("y", offsetof(Point, y), kFloat32);
  field("z", offsetof(Point, z), kFloat32);
  field("rgb", offsetof(Point, rgb), kFloat32);
  field("class", offsetof(Point, class_id), kUint16);
  field("object", offsetof(Point, object), kUint32);

  const std::size_t stride =
      std::max<std::size_t>(1, (surface.size() + most_points - 1) / most_points);
  std::map<std::uint32_t, OwnerAppearance> known;
  std::vector<std::uint8_t>& data = cloud.data();
  data.reserve((surface.size() / stride + 1) * sizeof(Point));
  std::size_t index = 0;
  for (const auto& [key, points] : surface.by_tile()) {
    for (const SurfacePoint& from : points) {
      if (index++ % stride != 0) continue;
      auto look = known.find(from.owner);
      if (look == known.end()) look = known.emplace(from.owner, appearance(from.owner)).first;
      const auto& rgb = look->second.rgb;
      const Point point{from.position_W.x(),
                        from.position_W.y(),
                        from.position_W.z(),
                        std::uint32_t{rgb[0]} << 16 | std::uint32_t{rgb[1]} << 8 | rgb[2],
                        static_cast<std::uint16_t>(look->second.class_id),
                        0,
                        from.owner};
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(&point);
      data.insert(data.end(), bytes, bytes + sizeof(Point));
    }
  }
  const auto count = static_cast<std::uint32_t>(data.size() / sizeof(Point));
  cloud.height(1);
  cloud.width(count);
  cloud.point_step(sizeof(Point));
  cloud.row_step(static_cast<std::uint32_t>(data.size()));
  cloud.is_dense(true);
  return cloud;
}

}  // namespace pocd::dds

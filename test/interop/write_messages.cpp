// Writes one message of each ROS 2 type that the component uses, as Fast DDS puts it on the bus,
// for check_cdr.js to compare with what another serialiser makes of the public definitions. usage:
// write_messages FOLDER   (one file per type, pkg.Type.cdr)
// FOLDER/pkg.Type.fields lists the fields in the order in which they were given.
//
// The fields are numbered in the order of the public definitions, 1, 2, 3, ...: an integer is its
// number (of one byte: modulo 100), a real one half more, a boolean whether it is odd, a text "s"
// and the number, an unbounded list has two entries. check_cdr.js does the same.
#include <fastcdr/Cdr.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "diagnostic_msgs.h"
#include "map_msgs.h"
#include "nav_msgs.h"
#include "rmf_obstacle_msgs.h"
#include "rmw_dds_common.h"
#include "rosgraph_msgs.h"
#include "sensor_msgs.h"
#include "tf2_msgs.h"
#include "visualization_msgs.h"

namespace {

/// A class, so that its overloads see one another whatever their order.
struct Filler {
  int number = 0;
  std::map<std::string, std::string> fields;  ///< of each type, as they are listed below

  template <class T>
  std::enable_if_t<std::is_arithmetic_v<T>> fill(T& value) {
    ++number;
    if constexpr (std::is_same_v<T, bool>) {
      value = number % 2 == 1;
    } else if constexpr (std::is_floating_point_v<T>) {
      value = static_cast<T>(number + 0.5);
    } else {
      value = static_cast<T>(sizeof(T) == 1 ? number % 100 : number);
    }
  }
  void fill(std::string& text) { text = "s" + std::to_string(++number); }
  template <class... Field>
  void fill_all(Field&... fields) {
    (fill(fields), ...);
  }

#define POCD_FIELDS(type, ...)    \
  void fill(type& m) {            \
    fields[#type] = #__VA_ARGS__; \
    fill_all(__VA_ARGS__);        \
  }

  POCD_FIELDS(builtin_interfaces::msg::Time, m.sec(), m.nanosec())
  POCD_FIELDS(builtin_interfaces::msg::Duration, m.sec(), m.nanosec())
  POCD_FIELDS(std_msgs::msg::Header, m.stamp(), m.frame_id())
  POCD_FIELDS(std_msgs::msg::ColorRGBA, m.r(), m.g(), m.b(), m.a())
  POCD_FIELDS(geometry_msgs::msg::Point, m.x(), m.y(), m.z())
  POCD_FIELDS(geometry_msgs::msg::Vector3, m.x(), m.y(), m.z())
  POCD_FIELDS(geometry_msgs::msg::Quaternion, m.x(), m.y(), m.z(), m.w())
  POCD_FIELDS(geometry_msgs::msg::Pose, m.position(), m.orientation())
  POCD_FIELDS(geometry_msgs::msg::PoseWithCovariance, m.pose(), m.covariance())
  POCD_FIELDS(geometry_msgs::msg::Twist, m.linear(), m.angular())
  POCD_FIELDS(geometry_msgs::msg::TwistWithCovariance, m.twist(), m.covariance())
  POCD_FIELDS(geometry_msgs::msg::Transform, m.translation(), m.rotation())
  POCD_FIELDS(geometry_msgs::msg::TransformStamped, m.header(), m.child_frame_id(), m.transform())
  POCD_FIELDS(tf2_msgs::msg::TFMessage, m.transforms())
  POCD_FIELDS(rosgraph_msgs::msg::Clock, m.clock())
  POCD_FIELDS(sensor_msgs::msg::Image, m.header(), m.height(), m.width(), m.encoding(),
              m.is_bigendian(), m.step(), m.data())
  POCD_FIELDS(sensor_msgs::msg::CompressedImage, m.header(), m.format(), m.data())
  POCD_FIELDS(sensor_msgs::msg::RegionOfInterest, m.x_offset(), m.y_offset(), m.height(), m.width(),
              m.do_rectify())
  POCD_FIELDS(sensor_msgs::msg::CameraInfo, m.header(), m.height(), m.width(), m.distortion_model(),
              m.d(), m.k(), m.r(), m.p(), m.binning_x(), m.binning_y(), m.roi())
  POCD_FIELDS(sensor_msgs::msg::PointField, m.name(), m.offset(), m.datatype(), m.count())
  POCD_FIELDS(sensor_msgs::msg::PointCloud2, m.header(), m.height(), m.width(), m.fields(),
              m.is_bigendian(), m.point_step(), m.row_step(), m.data(), m.is_dense())
  POCD_FIELDS(nav_msgs::msg::Odometry, m.header(), m.child_frame_id(), m.pose(), m.twist())
  POCD_FIELDS(nav_msgs::msg::MapMetaData, m.map_load_time(), m.resolution(), m.width(), m.height(),
              m.origin())
  POCD_FIELDS(nav_msgs::msg::OccupancyGrid, m.header(), m.info(), m.data())
  POCD_FIELDS(map_msgs::msg::OccupancyGridUpdate, m.header(), m.x(), m.y(), m.width(), m.height(),
              m.data())
  POCD_FIELDS(diagnostic_msgs::msg::KeyValue, m.key(), m.value())
  POCD_FIELDS(diagnostic_msgs::msg::DiagnosticStatus, m.level(), m.name(), m.message(),
              m.hardware_id(), m.values())
  POCD_FIELDS(diagnostic_msgs::msg::DiagnosticArray, m.header(), m.status())
  POCD_FIELDS(visualization_msgs::msg::UVCoordinate, m.u(), m.v())
  POCD_FIELDS(visualization_msgs::msg::MeshFile, m.filename(), m.data())
  POCD_FIELDS(visualization_msgs::msg::Marker, m.header(), m.ns(), m.id(), m.type(), m.action(),
              m.pose(), m.scale(), m.color(), m.lifetime(), m.frame_locked(), m.points(),
              m.colors(), m.texture_resource(), m.texture(), m.uv_coordinates(), m.text(),
              m.mesh_resource(), m.mesh_file(), m.mesh_use_embedded_materials())
  POCD_FIELDS(visualization_msgs::msg::MarkerArray, m.markers())
  POCD_FIELDS(rmf_obstacle_msgs::msg::BoundingBox3D, m.center(), m.size())
  POCD_FIELDS(rmf_obstacle_msgs::msg::Obstacle, m.header(), m.id(), m.source(), m.level_name(),
              m.classification(), m.bbox(), m.data_resolution(), m.data(), m.lifetime(), m.action())
  POCD_FIELDS(rmf_obstacle_msgs::msg::Obstacles, m.header(), m.obstacles())
  POCD_FIELDS(rmf_obstacle_msgs::msg::ObstaclesHumble, m.obstacles())
  POCD_FIELDS(rmw_dds_common::msg::Gid, m.data())
  POCD_FIELDS(rmw_dds_common::msg::NodeEntitiesInfo, m.node_namespace(), m.node_name(),
              m.reader_gid_seq(), m.writer_gid_seq())
  POCD_FIELDS(rmw_dds_common::msg::ParticipantEntitiesInfo, m.gid(), m.node_entities_info_seq())
  POCD_FIELDS(rmw_dds_common::msg::GidHumble, m.data())
  POCD_FIELDS(rmw_dds_common::msg::NodeEntitiesInfoHumble, m.node_namespace(), m.node_name(),
              m.reader_gid_seq(), m.writer_gid_seq())
  POCD_FIELDS(rmw_dds_common::msg::ParticipantEntitiesInfoHumble, m.gid(),
              m.node_entities_info_seq())

  template <class T, std::size_t N>
  void fill(std::array<T, N>& values) {
    for (T& value : values) fill(value);
  }
  template <class T>
  void fill(std::vector<T>& values) {
    values.resize(2);
    for (T& value : values) fill(value);
  }
};

template <class Message>
void write(const std::string& folder, const std::string& name) {
  Message message;
  Filler filler;
  filler.fill(message);
  std::ofstream names(folder + "/" + name + ".fields");
  for (const auto& [type, list] : filler.fields) names << type << ": " << list << '\n';
  std::vector<char> memory(100'000);  // zero, as padding is not written
  eprosima::fastcdr::FastBuffer buffer(memory.data(), memory.size());
  eprosima::fastcdr::Cdr cdr(buffer, eprosima::fastcdr::Cdr::LITTLE_ENDIANNESS,
                             eprosima::fastcdr::Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  message.serialize(cdr);
  std::ofstream(folder + "/" + name + ".cdr", std::ios::binary)
      .write(cdr.getBufferPointer(), static_cast<std::streamsize>(cdr.getSerializedDataLength()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: write_messages FOLDER\n", stderr);
    return 2;
  }
  const std::string folder = argv[1];
  write<sensor_msgs::msg::Image>(folder, "sensor_msgs.Image");
  write<sensor_msgs::msg::CompressedImage>(folder, "sensor_msgs.CompressedImage");
  write<sensor_msgs::msg::CameraInfo>(folder, "sensor_msgs.CameraInfo");
  write<sensor_msgs::msg::PointCloud2>(folder, "sensor_msgs.PointCloud2");
  write<nav_msgs::msg::Odometry>(folder, "nav_msgs.Odometry");
  write<nav_msgs::msg::OccupancyGrid>(folder, "nav_msgs.OccupancyGrid");
  write<map_msgs::msg::OccupancyGridUpdate>(folder, "map_msgs.OccupancyGridUpdate");
  write<tf2_msgs::msg::TFMessage>(folder, "tf2_msgs.TFMessage");
  write<rosgraph_msgs::msg::Clock>(folder, "rosgraph_msgs.Clock");
  write<diagnostic_msgs::msg::DiagnosticArray>(folder, "diagnostic_msgs.DiagnosticArray");
  write<visualization_msgs::msg::MarkerArray>(folder, "visualization_msgs.MarkerArray");
  write<rmf_obstacle_msgs::msg::Obstacles>(folder, "rmf_obstacle_msgs.Obstacles@iron");
  write<rmf_obstacle_msgs::msg::ObstaclesHumble>(folder, "rmf_obstacle_msgs.Obstacles@humble");
  write<rmw_dds_common::msg::ParticipantEntitiesInfo>(
      folder, "rmw_dds_common.ParticipantEntitiesInfo@iron");
  write<rmw_dds_common::msg::ParticipantEntitiesInfoHumble>(
      folder, "rmw_dds_common.ParticipantEntitiesInfo@humble");
}

// Messages that Rerun's reader does not take, in messages that it takes; and what `pocd_record`
// says of those that it leaves out.
#include <gtest/gtest.h>

#include <cstring>

#include "bus_processes.hpp"
#include "nav_msgsPubSubTypes.h"
#include "pocd/common/random.hpp"
#include "pocd/recording/recording_reader.hpp"
#include "pocd_dds/entities/topic_table.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/recording/rerun_form.hpp"
#include "recordings.hpp"
#include "sensor_msgsPubSubTypes.h"
#include "tf2_msgsPubSubTypes.h"
#include "visualization_msgsPubSubTypes.h"

namespace pocd::dds {
namespace {

using recording::Bytes;
using sensor_msgs::msg::PointCloud2;
using visualization_msgs::msg::Marker;
using visualization_msgs::msg::MarkerArray;

RecordedTopic topic(const TopicSpec& spec) {
  RecordedTopic one;
  one.name = spec.name;
  one.type = spec.type;
  return one;
}

template <class PubSubType>
Bytes encoded(typename PubSubType::type message) {
  PubSubType type;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(type.getSerializedSizeProvider(&message)());
  EXPECT_TRUE(type.serialize(&message, &payload));
  return Bytes(payload.data, payload.data + payload.length);
}

template <class PubSubType>
typename PubSubType::type decoded(Bytes bytes) {
  eprosima::fastrtps::rtps::SerializedPayload_t payload;
  payload.data = bytes.data();
  payload.length = payload.max_size = static_cast<std::uint32_t>(bytes.size());
  typename PubSubType::type message;
  EXPECT_TRUE(PubSubType().deserialize(&payload, &message));
  payload.data = nullptr;
  return message;
}

PointCloud2 cloud_of(const Bytes& bytes) {
  return decoded<sensor_msgs::msg::PointCloud2PubSubType>(bytes);
}

template <class T>
T value(const PointCloud2& cloud, const char* name, std::size_t point) {
  for (const auto& field : cloud.fields()) {
    if (field.name() != name) continue;
    T value{};
    std::memcpy(&value, cloud.data().data() + point * cloud.point_step() + field.offset(),
                sizeof value);
    return value;
  }
  ADD_FAILURE() << "no field " << name;
  return {};
}

Marker box(std::int32_t id, double x, std::int32_t action = 0) {
  Marker marker;
  marker.header().frame_id("map");
  marker.header().stamp().sec(7);
  marker.ns("pocd");
  marker.id(id);
  marker.type(1);
  marker.action(action);
  marker.pose().position().x(x);
  marker.pose().orientation().z(std::sqrt(0.5));  // a quarter turn
  marker.pose().orientation().w(std::sqrt(0.5));
  marker.scale().x(2.0);
  marker.scale().y(1.0);
  marker.scale().z(0.5);
  marker.color().r(1.0f);
  marker.color().g(0.5f);
  marker.color().a(0.3f);
  return marker;
}

Bytes markers(std::vector<Marker> list) {
  MarkerArray array;
  array.markers(std::move(list));
  return encoded<visualization_msgs::msg::MarkerArrayPubSubType>(array);
}

TEST(RerunForm, ACloudGetsColours) {
  PointCloud2 cloud;
  const auto field = [&](const char* name, std::uint32_t offset) {
    auto& one = cloud.fields().emplace_back();
    one.name(name);
    one.offset(offset);
    one.datatype(7);
    one.count(1);
  };
  field("x", 0);
  field("rgb", 4);
  for (std::uint32_t i = 0; i < 3; ++i) {
    const float x = static_cast<float>(i);
    const std::uint32_t rgb = 0x010203 + i;
    for (const void* part : {static_cast<const void*>(&x), static_cast<const void*>(&rgb)}) {
      const auto* bytes = static_cast<const std::uint8_t*>(part);
      cloud.data().insert(cloud.data().end(), bytes, bytes + 4);
    }
  }
  cloud.height(1);
  cloud.width(3);
  cloud.point_step(8);
  cloud.row_step(24);
  auto form = RerunForm::of(topic(topics::kSurface));
  ASSERT_TRUE(form);
  EXPECT_FALSE(form->second()) << "it takes the place of the cloud";
  const Bytes before = encoded<sensor_msgs::msg::PointCloud2PubSubType>(cloud);
  const auto bytes = form->convert(before);
  ASSERT_TRUE(bytes);
  const PointCloud2 made = cloud_of(*bytes);
  EXPECT_EQ(made.point_step(), 12u);
  EXPECT_EQ(made.width(), 3u);
  EXPECT_EQ(made.data().size(), made.row_step());
  EXPECT_EQ(value<float>(made, "x", 2), 2.0f);
  EXPECT_EQ(value<std::uint32_t>(made, "rgb", 2), 0x010205u);
  EXPECT_EQ(value<std::uint32_t>(made, "colors", 2), 0x010205FFu);
  // One that has them, or has no colours, stays.
  EXPECT_FALSE(form->convert(*bytes));
  cloud.fields().pop_back();
  EXPECT_FALSE(form->convert(encoded<sensor_msgs::msg::PointCloud2PubSubType>(cloud)));
}

TEST(RerunForm, BoxesBecomeTheirEdges) {
  const RecordedTopic from = topic(topics::kMarkers);
  auto form = RerunForm::of(from);
  ASSERT_TRUE(form && form->second());
  EXPECT_EQ(form->second()->name, "sensor_msgs/msg/PointCloud2");
  EXPECT_EQ(RerunForm::second_name(from), "/pocd/objects/markers/rerun");
  const PointCloud2 made = cloud_of(*form->convert(markers({box(1, 5.0)})));
  EXPECT_EQ(made.header().frame_id(), "map");
  EXPECT_EQ(made.header().stamp().sec(), 7);
  ASSERT_GT(made.width(), 300u);
  EXPECT_EQ(made.data().size(), std::size_t{made.width()} * made.point_step());
  double low_y = 9, high_y = -9, high_x = -9;
  for (std::size_t i = 0; i < made.width(); ++i) {
    // Turned by a quarter: 2 m along y, 1 m along x. A point of an edge is at two sides of the box.
    const double x = value<float>(made, "x", i) - 5.0, y = value<float>(made, "y", i),
                 z = value<float>(made, "z", i);
    const int sides = (std::abs(std::abs(x) - 0.5) < 1e-4) + (std::abs(std::abs(y) - 1.0) < 1e-4) +
                      (std::abs(std::abs(z) - 0.25) < 1e-4);
    ASSERT_GE(sides, 2) << x << ' ' << y << ' ' << z;
    low_y = std::min(low_y, y);
    high_y = std::max(high_y, y);
    high_x = std::max(high_x, x);
  }
  EXPECT_NEAR(low_y, -1.0, 1e-4);
  EXPECT_NEAR(high_y, 1.0, 1e-4);
  EXPECT_NEAR(high_x, 0.5, 1e-4);
  EXPECT_EQ(value<std::uint32_t>(made, "colors", 0), 0xFF8000FFu);
  EXPECT_GT(value<float>(made, "radii", 0), 0.005f);
}

TEST(RerunForm, WhatStandsIsWhatMarkersHaveAddedUpTo) {
  auto form = RerunForm::of(topic(topics::kMarkers));
  const auto width = [&](std::vector<Marker> list) {
    return cloud_of(*form->convert(markers(std::move(list)))).width();
  };
  const auto one = width({box(1, 0.0)});
  EXPECT_EQ(width({box(2, 3.0)}), 2 * one);
  EXPECT_EQ(width({box(2, 4.0)}), 2 * one) << "it has moved";
  EXPECT_EQ(width({box(1, 0.0, 2)}), one) << "deleted";
  Marker sphere = box(2, 4.0);
  sphere.type(2);
  EXPECT_EQ(width({sphere}), 0u);
  EXPECT_EQ(width({box(1, 0.0), box(0, 0.0, 3), box(5, 0.0)}), one) << "all before are deleted";
  Marker nowhere = box(6, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(width({nowhere}), one);
  EXPECT_FALSE(form->convert(markers({})));
}

TEST(RerunForm, WhatIsLeftOutIsCountedByName) {
  auto form = RerunForm::of(topic(topics::kMarkers));
  form->convert(markers({box(1, 0.0)}));
  EXPECT_TRUE(form->left_out().empty());
  Marker text = box(2, 0.0), unknown = box(3, 0.0), elsewhere = box(4, 0.0);
  text.type(9);
  unknown.type(77);
  elsewhere.header().frame_id("odom");
  const Marker nowhere = box(5, std::numeric_limits<double>::quiet_NaN());
  form->convert(markers({text, text, unknown, elsewhere, nowhere, box(6, 1.0)}));
  form->convert(Bytes{0, 1, 0, 0, 7});
  const std::map<std::string, std::uint64_t> expected{
      {"markers of type 9 (text)", 2},
      {"markers of type 77", 1},
      {"boxes in another frame than the last marker of a message", 1},
      {"boxes whose place or size is no number", 1},
      {"damaged messages", 1}};
  EXPECT_EQ(form->left_out(), expected);
  std::vector<Marker> many;
  for (std::int32_t i = 0; i < 20010; ++i) many.push_back(box(i, 0.1 * i));
  many[4].header().frame_id("map");
  auto full = RerunForm::of(topic(topics::kMarkers));
  full->convert(markers(many));
  EXPECT_EQ(full->left_out(), (std::map<std::string, std::uint64_t>{{"boxes beyond 20000", 10}}));
}

TEST(RerunForm, OfManyBoxesTheEdgesHaveFewerPoints) {
  auto form = RerunForm::of(topic(topics::kMarkers));
  std::vector<Marker> many;
  for (std::int32_t i = 0; i < 3000; ++i) many.push_back(box(i, 0.1 * i));
  const PointCloud2 made = cloud_of(*form->convert(markers(many)));
  EXPECT_GE(made.width(), 3000u * 24u);
  EXPECT_LE(made.width(), 200000u);
}

TEST(RerunForm, APoseOfOdometryBecomesATransform) {
  auto form = RerunForm::of(topic(topics::kOdometry));
  ASSERT_TRUE(form && form->second());
  EXPECT_EQ(form->second()->name, "tf2_msgs/msg/TFMessage");
  nav_msgs::msg::Odometry odometry;
  odometry.header().frame_id("map");
  odometry.header().stamp().nanosec(5);
  odometry.child_frame_id("base");
  odometry.pose().pose().position().y(2.5);
  odometry.pose().pose().orientation().w(1.0);
  const auto tf = decoded<tf2_msgs::msg::TFMessagePubSubType>(
      *form->convert(encoded<nav_msgs::msg::OdometryPubSubType>(odometry)));
  ASSERT_EQ(tf.transforms().size(), 1u);
  EXPECT_EQ(tf.transforms()[0].header().frame_id(), "map");
  EXPECT_EQ(tf.transforms()[0].header().stamp().nanosec(), 5u);
  EXPECT_EQ(tf.transforms()[0].child_frame_id(), "base");
  EXPECT_EQ(tf.transforms()[0].transform().translation().y(), 2.5);
}

TEST(RerunForm, DamagedMessagesAndOtherTopicsStay) {
  EXPECT_FALSE(RerunForm::of(topic(topics::kOccupancy)));
  Random random(5);
  const Bytes whole = markers({box(1, 0.0), box(2, 0.0)});
  for (const TopicSpec* spec : {&topics::kMarkers, &topics::kSurface, &topics::kOdometry}) {
    auto form = RerunForm::of(topic(*spec));
    for (std::size_t size = 0; size < whole.size(); ++size) {
      form->convert(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
    }
    for (int i = 0; i < 500; ++i) {
      Bytes noise = whole;
      for (int k = 0; k < 4; ++k) {
        noise[4 + random.below(noise.size() - 4)] = static_cast<std::uint8_t>(random.below(256));
      }
      form->convert(noise);
    }
  }
  // What was made is on no bus: it is not played.
  recording::RecordedChannel made;
  made.topic = "/pocd/objects/markers/rerun";
  made.type = "sensor_msgs/msg/PointCloud2";
  made.message_encoding = "cdr";
  EXPECT_TRUE(topic_of(made));
  made.metadata[kMadeOf] = "/pocd/objects/markers";
  EXPECT_FALSE(topic_of(made));
}

TEST(RerunForm, TheRecorderNamesAndCountsWhatItLeavesOut) {
  const recording::TemporaryFolder folder;
  Process recorder({command("pocd_record"), "--output", (folder / "run.mcap").string(), "--rerun"});
  ASSERT_TRUE(says(recorder, "recording on domain"));
  const auto participant =
      std::make_shared<Participant>(BusOptions{std::stoi(test_domain()), "", "markers_of_a_test"});
  Writer<visualization_msgs::msg::MarkerArrayPubSubType> writer(participant, topics::kMarkers);
  while (writer.matched() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  Marker text = box(2, 0.0);
  text.type(9);
  for (const std::vector<Marker>& list :
       {std::vector<Marker>{box(1, 0.0)}, {text, box(1, 0.0)}, {text, text, box(3, 1.0)}}) {
    MarkerArray array;
    array.markers(list);
    writer.write(array);
    ASSERT_TRUE(writer.wait_acknowledged(std::chrono::seconds(60)));
  }
  const CommandResult recorded = stop(recorder);
  EXPECT_NE(
      recorded.out.find(
          "not in the form for Rerun: 3 of /pocd/objects/markers: markers of type 9 (text)\n"),
      std::string::npos)
      << recorded.out;
  // Each thing once, when it comes first.
  const std::string warning = "Rerun will not show markers of type 9 (text)";
  const std::size_t first = recorded.err.find(warning);
  EXPECT_NE(first, std::string::npos) << recorded.err;
  EXPECT_EQ(recorded.err.find(warning, first + 1), std::string::npos) << recorded.err;
  // The recording has all of them.
  std::map<std::string, int> messages;
  const auto reader = recording::open_recording(folder / "run.mcap");
  for (const recording::Kept& kept : recording::read_all(*reader)) ++messages[kept.topic];
  EXPECT_EQ(messages["/pocd/objects/markers"], 3);
  EXPECT_EQ(messages["/pocd/objects/markers/rerun"], 3);
}

}  // namespace
}  // namespace pocd::dds

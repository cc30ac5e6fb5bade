// Messages to core types: what is taken, what is refused and by which name.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pocd/common/check.hpp"
#include "pocd/common/random.hpp"
#include "pocd_dds/bridge/image_visit.hpp"
#include "pocd_dds/bridge/look_messages.hpp"
#include "pocd_dds/bridge/map_messages.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "sensor_msgsPubSubTypes.h"

namespace pocd::dds {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The message as it is on the bus.
std::unique_ptr<eprosima::fastrtps::rtps::SerializedPayload_t> payload_of(
    const sensor_msgs::msg::Image& message) {
  sensor_msgs::msg::Image copy = message;
  sensor_msgs::msg::ImagePubSubType type;
  auto payload = std::make_unique<eprosima::fastrtps::rtps::SerializedPayload_t>(
      type.getSerializedSizeProvider(&copy)());
  EXPECT_TRUE(type.serialize(&copy, payload.get()));
  return payload;
}

/// What `check` says of it where it lies in a payload.
template <class Check>
auto visited(const sensor_msgs::msg::Image& message, const Check& check) {
  std::optional<decltype(check(ImageView{}))> result;
  ImageVisit visit{[&](const recording::RosImage& seen) { result = check(view_of(seen)); }};
  EXPECT_TRUE(ImageVisitType().deserialize(payload_of(message).get(), &visit));
  return *result;
}
Checked<cv::Mat> depth_from(const sensor_msgs::msg::Image& message) {
  return visited(message, depth_image);
}
Checked<cv::Mat> color_from(const sensor_msgs::msg::Image& message) {
  return visited(message, color_image);
}
Checked<LabelImage> labels_from(const sensor_msgs::msg::Image& message, const LabelTable& colours) {
  return visited(message, [&](const ImageView& view) { return label_image(view, colours); });
}

sensor_msgs::msg::Image image(const std::string& encoding, std::uint32_t pixel_bytes) {
  sensor_msgs::msg::Image message;
  message.width(4);
  message.height(3);
  message.encoding(encoding);
  message.step(4 * pixel_bytes);
  message.data().assign(12 * pixel_bytes, 0);
  return message;
}

TEST(DepthFrom, TakesExactlyTheDocumentedEncodings) {
  const struct {
    const char* encoding;
    std::uint32_t bytes;
    int type;  // -1: refused
  } cases[] = {
      {"16UC1", 2, CV_16UC1}, {"mono16", 2, CV_16UC1}, {"32FC1", 4, CV_32FC1}, {"mono8", 1, -1},
      {"64FC1", 8, -1},       {"rgb8", 3, -1},         {"16UC1 ", 2, -1},      {"", 2, -1},
      {"32fc1", 4, -1}};
  for (const auto& c : cases) {
    const Checked<cv::Mat> depth = depth_from(image(c.encoding, c.bytes));
    ASSERT_EQ(depth.value.has_value(), c.type >= 0) << c.encoding;
    if (c.type >= 0) {
      EXPECT_EQ(depth.value->type(), c.type) << c.encoding;
    } else {
      EXPECT_EQ(depth.problem->reason, InputReason::kUnknownEncoding) << c.encoding;
    }
  }
}

TEST(DepthFrom, HonoursARowStepWithPadding) {
  auto message = image("16UC1", 2);
  message.step(10);  // 8 bytes of pixels, 2 of padding
  message.data().assign(30, 0xEE);
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 4; ++col) {
      message.data()[row * 10 + col * 2] = static_cast<std::uint8_t>(row * 4 + col);
      message.data()[row * 10 + col * 2 + 1] = 0;
    }
  }
  const Checked<cv::Mat> depth = depth_from(message);
  ASSERT_TRUE(depth.value);
  for (int i = 0; i < 12; ++i) EXPECT_EQ(depth.value->at<std::uint16_t>(i / 4, i % 4), i);
}

TEST(DepthFrom, NamesEveryDefectOfTheLayout) {
  const auto reason = [](auto change) {
    auto message = image("16UC1", 2);
    change(message);
    const Checked<cv::Mat> depth = depth_from(message);
    return depth.problem ? std::string(to_string(depth.problem->reason)) : "accepted";
  };
  using Image = sensor_msgs::msg::Image;
  EXPECT_EQ(reason([](Image&) {}), "accepted");
  EXPECT_EQ(reason([](Image& m) { m.width(0); }), "empty_image");
  EXPECT_EQ(reason([](Image& m) { m.height(0); }), "empty_image");
  EXPECT_EQ(reason([](Image& m) { m.step(7); }), "step_too_small");
  EXPECT_EQ(reason([](Image& m) { m.step(0xFFFFFFFFu); }), "data_size");
  EXPECT_EQ(reason([](Image& m) { m.data().pop_back(); }), "data_size");
  EXPECT_EQ(reason([](Image& m) { m.data().push_back(0); }), "data_size");
  EXPECT_EQ(reason([](Image& m) { m.data().clear(); }), "data_size");
  EXPECT_EQ(reason([](Image& m) { m.is_bigendian(1); }), "accepted") << "and its bytes swapped";
  EXPECT_EQ(reason([](Image& m) { m.width(0x80000000u); }), "too_large");
  EXPECT_EQ(reason([](Image& m) { m.height(100000); }), "too_large");
}

// Whatever the header fields are: an image that is accepted has exactly the bytes that are read.
TEST(ImagesFrom, RandomHeadersNeverReadBeyondTheData) {
  Random random(4);
  const LabelTable colours{ClassMap{}};
  const char* encodings[] = {"16UC1", "32FC1", "mono8", "mono16", "rgb8", "bgr8", "8UC1"};
  int accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    sensor_msgs::msg::Image message;
    message.encoding(encodings[random.below(7)]);
    message.width(static_cast<std::uint32_t>(random.below(6)));
    message.height(static_cast<std::uint32_t>(random.below(6)));
    message.step(static_cast<std::uint32_t>(random.below(30)));
    // Half of the time the size that fits, else anything.
    const std::size_t fitting = std::size_t{message.step()} * message.height();
    message.data().assign(random.below(2) ? fitting : random.below(100), 7);
    for (const bool taken :
         {depth_from(message).value.has_value(), color_from(message).value.has_value(),
          labels_from(message, colours).value.has_value()}) {
      if (!taken) continue;
      ++accepted;
      EXPECT_EQ(message.data().size(), fitting);
      EXPECT_GT(message.width() * message.height(), 0u);
    }
  }
  EXPECT_GT(accepted, 1000);  // the sweep reaches the accepting branch
}

TEST(LabelsFrom, ColoursBecomeClassesAndUnknownOnesAreCounted) {
  ClassMap classes;
  classes.list = {ClassInfo{7, "box", ClassRole::kObject, 0, "0,153,153"},
                  ClassInfo{4, "fence", ClassRole::kObject, 1, "255, 0, 102"}};
  const LabelTable colours(classes);
  for (const bool rgb : {true, false}) {
    auto message = image(rgb ? "rgb8" : "bgr8", 3);
    const auto paint = [&](int pixel, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
      message.data()[pixel * 3] = rgb ? r : b;
      message.data()[pixel * 3 + 1] = g;
      message.data()[pixel * 3 + 2] = rgb ? b : r;
    };
    paint(0, 0, 153, 153);
    paint(1, 255, 0, 102);
    paint(2, 1, 2, 3);
    const Checked<LabelImage> labels = labels_from(message, colours);
    ASSERT_TRUE(labels.value);
    EXPECT_EQ(labels.value->labels.at<std::uint16_t>(0, 0), 7);
    EXPECT_EQ(labels.value->labels.at<std::uint16_t>(0, 1), 4);
    EXPECT_EQ(labels.value->labels.at<std::uint16_t>(0, 2), 0);
    EXPECT_EQ(labels.value->unknown_pixels, 10u);  // the other ones are black, no class either
  }
}

TEST(ImageVisit, RefusesEveryShorterPayload) {
  auto message = image("16UC1", 2);
  message.header().frame_id("camera");
  const auto whole = payload_of(message);
  int visits = 0;
  ImageVisit visit{[&](const recording::RosImage& seen) {
    ++visits;
    EXPECT_EQ(seen.header.frame_id, "camera");
    EXPECT_EQ(seen.size, 24u);
  }};
  const std::uint32_t length = whole->length;
  // The padding behind the last field is nobody's.
  while (whole->length > 0 && ImageVisitType().deserialize(whole.get(), &visit)) --whole->length;
  EXPECT_EQ(visits, static_cast<int>(length - whole->length));
  EXPECT_GE(visits, 1);
  EXPECT_LE(visits, 4);
  const int all = visits;
  for (; whole->length > 0; --whole->length) {
    EXPECT_FALSE(ImageVisitType().deserialize(whole.get(), &visit));
  }
  EXPECT_EQ(visits, all);
}

TEST(ImagesFrom, AMaskOfBytesAndOneOfWordsAreTheSameClasses) {
  const LabelTable colours{ClassMap{}};
  auto narrow = image("mono8", 1), wide = image("mono16", 2);
  for (std::size_t i = 0; i < 12; ++i) narrow.data()[i] = wide.data()[2 * i] = std::uint8_t(20 * i);
  const Checked<LabelImage> a = labels_from(narrow, colours), b = labels_from(wide, colours);
  ASSERT_TRUE(a.value && b.value);
  ASSERT_EQ(a.value->labels.type(), CV_16UC1);
  ASSERT_EQ(b.value->labels.type(), CV_16UC1);
  for (int i = 0; i < 12; ++i) {
    EXPECT_EQ(a.value->labels.at<std::uint16_t>(i / 4, i % 4),
              b.value->labels.at<std::uint16_t>(i / 4, i % 4));
  }
  EXPECT_EQ(a.value->labels.at<std::uint16_t>(2, 3), 220);
}

TEST(ImagesFrom, RedGreenBlueIsTurnedRound) {
  auto message = image("rgb8", 3);
  message.step(13);  // a row of 12 bytes, and one of padding
  message.data().assign(39, 0);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t i = 0; i < 12; ++i) message.data()[13 * row + i] = std::uint8_t(50 * row + i);
  }
  const Checked<cv::Mat> color = color_from(message);
  ASSERT_TRUE(color.value);
  EXPECT_EQ(color.value->at<cv::Vec3b>(2, 1), cv::Vec3b(105, 104, 103));
}

TEST(LabelTable, RefusesColoursThatAreNone) {
  for (const char* rgb : {"1,2", "1,2,256", "-1,2,3", "red", "1,2,3,4", "1,2,3x"}) {
    ClassMap classes;
    classes.list = {ClassInfo{7, "box", ClassRole::kObject, 0, rgb}};
    EXPECT_THROW(LabelTable{classes}, InputError) << rgb;
  }
  ClassMap twice;
  twice.list = {ClassInfo{1, "a", ClassRole::kObject, 0, "1,2,3"},
                ClassInfo{2, "b", ClassRole::kObject, 0, "1,2,3"}};
  EXPECT_THROW(LabelTable{twice}, InputError);
}

TEST(CameraFrom, NamesWhatIsWrong) {
  const auto reason = [](auto change) {
    auto message = camera_message({640, 480, 500, 501, 320, 240}, 5, "camera");
    change(message);
    const Checked<CameraModel> camera = camera_from(message);
    return camera.problem ? std::string(to_string(camera.problem->reason)) : "accepted";
  };
  using Info = sensor_msgs::msg::CameraInfo;
  EXPECT_EQ(reason([](Info&) {}), "accepted");
  EXPECT_EQ(reason([](Info& m) { m.k()[0] = 0; }), "zero_focal_length");
  EXPECT_EQ(reason([](Info& m) { m.k()[4] = -1; }), "zero_focal_length");
  EXPECT_EQ(reason([](Info& m) { m.k()[2] = kNaN; }), "not_finite");
  EXPECT_EQ(reason([](Info& m) { m.width(0); }), "bad_image_size");
}

TEST(TransformFrom, NamesWhatIsWrongAndKeepsGoodBits) {
  const auto reason = [](auto change) {
    auto message = odometry_message({"map", "base", 5, PoseQuaternion{}});
    change(message);
    const Checked<StampedTransform> pose = transform_from(message);
    return pose.problem ? std::string(to_string(pose.problem->reason)) : "accepted";
  };
  using Odometry = nav_msgs::msg::Odometry;
  EXPECT_EQ(reason([](Odometry&) {}), "accepted");
  EXPECT_EQ(reason([](Odometry& m) { m.pose().pose().position().y(kNaN); }), "not_finite");
  EXPECT_EQ(reason([](Odometry& m) { m.pose().pose().orientation().w(kNaN); }), "not_finite");
  EXPECT_EQ(reason([](Odometry& m) { m.pose().pose().orientation().w(0); }), "non_unit_quaternion");
  EXPECT_EQ(reason([](Odometry& m) { m.pose().pose().orientation().w(1.01); }),
            "non_unit_quaternion");
  EXPECT_EQ(reason([](Odometry& m) { m.child_frame_id(""); }), "empty_frame_name");

  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    PoseQuaternion T;
    T.position = {random.normal(), random.normal(), random.normal()};
    T.rotation =
        Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
            .normalized();
    const auto back = transform_from(odometry_message({"map", "base", 5, T}));
    ASSERT_TRUE(back.value);
    EXPECT_EQ(back.value->T.position, T.position);
    EXPECT_EQ(back.value->T.rotation.coeffs(), T.rotation.coeffs());
  }
}

TEST(Stamps, RoundTripIncludingBeforeTheEpoch) {
  for (const StampNs stamp : {StampNs{0}, StampNs{1}, StampNs{-1},
                              StampNs{1'700'000'000'123'456'789}, StampNs{-1'000'000'000}}) {
    EXPECT_EQ(to_stamp(to_time(stamp)), stamp);
    EXPECT_LT(to_time(stamp).nanosec(), 1'000'000'000u);
  }
}

TEST(EventMessages, AddedCarriesItsArrival) {
  ObjectEvent event;
  event.kind = EventKind::kAdded;
  for (const Arrival arrival : {Arrival::kUnknown, Arrival::kFound, Arrival::kArrived}) {
    event.arrival = arrival;
    EXPECT_EQ(event_from(event_message(event, {0, 1}, ClassMap{}, "map")).arrival, arrival);
  }
  pocd_msgs::msg::ObjectEvent later = event_message(event, {0, 1}, ClassMap{}, "map");
  later.arrival(9);
  EXPECT_EQ(event_from(later).arrival, Arrival::kUnknown) << "a word of a later program";
}

TEST(ObjectUuid, IsNeverTheSameForTwoObjectsOrRuns) {
  EXPECT_NE(object_uuid(1, ObjectId{2}), object_uuid(2, ObjectId{1}));
  EXPECT_NE(object_uuid(1, ObjectId{1}), object_uuid(1, ObjectId{256}));
  EXPECT_EQ(object_uuid(3, ObjectId{4}), object_uuid(3, ObjectId{4}));
}

TEST(LookMessages, CarryARegionsLastLookAndNothingThatCannotBe) {
  const dds::SectorKey sector = dds::sector_of({-1, 7, 8});
  EXPECT_TRUE((sector == dds::SectorKey{-1, 0, 1}));
  const std::map<BlockKey, dds::SectorLook> regions{{{-1, 7, 8}, {1'500'000'000, false}},
                                                    {{-8, 0, 15}, {-2, true}}};
  const auto message = dds::looks_message(sector, regions, {3, 5, 7});
  EXPECT_EQ(message.map_id(), 3u);
  EXPECT_EQ(message.epoch(), 5u);
  EXPECT_EQ(message.lineage(), 7u);
  const auto back = dds::looks_from(message);
  ASSERT_TRUE(back);
  ASSERT_EQ(back->size(), regions.size());
  for (const auto& [region, look] : regions) {
    ASSERT_EQ(back->count(region), 1u);
    EXPECT_EQ(back->at(region).stamp_ns, look.stamp_ns);
    EXPECT_EQ(back->at(region).in_run, look.in_run);
  }
  auto outside = message;
  outside.regions().front().x(0);
  EXPECT_FALSE(dds::looks_from(outside)) << "a region of another sector";
  auto twice = message;
  twice.regions().push_back(twice.regions().front());
  EXPECT_FALSE(dds::looks_from(twice));
}

TEST(DeltaMessages, PartsCarryTheWholeStepAndDamageIsNoticed) {
  MapDelta delta;
  delta.epoch = 9;
  delta.base_version = 3;
  delta.version = 4;
  delta.digest.low = 11;
  for (int i = 0; i < 10; ++i) {
    delta.changed.push_back({{i, 0, -i}, 4, std::vector<std::uint8_t>(100 + i, 3)});
  }
  delta.removed = {{7, 7, 7}};
  std::vector<pocd_msgs::msg::MapDelta> parts;
  for (DeltaParts wanted = delta_parts(delta, 0, 5, 250); wanted.left() > 0;) {
    parts.push_back(wanted.next());
  }
  ASSERT_EQ(parts.size(), 5u);  // two payloads of about 100 bytes fit into 250
  const auto whole = delta_from(parts);
  ASSERT_TRUE(whole);
  ASSERT_EQ(whole->changed.size(), 10u);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(whole->changed[i].payload, delta.changed[i].payload);
    EXPECT_TRUE(whole->changed[i].key == delta.changed[i].key);
  }
  EXPECT_EQ(whole->removed.size(), 1u);
  EXPECT_EQ(whole->digest, delta.digest);
  parts[2].changed()[0].payload()[5] ^= 1;
  EXPECT_FALSE(delta_from(parts));
}

}  // namespace
}  // namespace pocd::dds

// Payloads that are no messages: counted by topic, and nothing ends for them.
#include <gtest/gtest.h>

#include <atomic>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>

#include "over_the_bus.hpp"
#include "pocd_dds/bridge/image_visit.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_dds/object_watch.hpp"
#include "robot_sender.hpp"

namespace pocd {
namespace {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using Bytes = std::vector<std::uint8_t>;

/// Any bytes under the name of a type.
class BytesType : public eprosima::fastdds::dds::TopicDataType {
 public:
  BytesType(const char* name, bool keyed) {
    setName(name);
    m_typeSize = 4096;
    m_isGetKeyDefined = keyed;
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<Bytes*>(data);
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t* handle, bool) override {
    handle->value[0] = 1;
    return true;
  }
};

class BytesWriter {
 public:
  BytesWriter(const std::shared_ptr<dds::Participant>& bus, const dds::TopicSpec& spec,
              const std::string& topic)
      : bus_(bus), topic_(topic) {
    dds::Delivery delivery = spec.delivery;
    delivery.reliable = true;
    delivery.keep_last = 200;
    delivery.max_instances = 0;
    use_ = bus->topic(topic,
                      eprosima::fastdds::dds::TypeSupport(new BytesType(spec.type, spec.keyed)));
    writer_ =
        bus->publisher()->create_datawriter(use_.get(), bus->writer_qos(topic, delivery), nullptr);
  }
  ~BytesWriter() { bus_->publisher()->delete_datawriter(writer_); }
  BytesWriter(const BytesWriter&) = delete;
  BytesWriter& operator=(const BytesWriter&) = delete;
  const std::string& topic() const { return topic_; }
  int matched() const {
    eprosima::fastdds::dds::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return status.current_count;
  }
  void send(Bytes bytes) const { EXPECT_TRUE(writer_->write(&bytes)) << topic_; }
  /// Whoever acknowledges has found all writers of this participant that were made before this one:
  /// they are announced in the order of their making.
  bool acknowledged() const {
    return writer_->wait_for_acknowledgments({120, 0}) ==
           eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
  }

 private:
  std::shared_ptr<dds::Participant> bus_;
  std::string topic_;
  std::shared_ptr<eprosima::fastdds::dds::Topic> use_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

const Bytes kNoEncapsulation{0x77, 0x77, 0, 0, 1, 2, 3, 4};  // that there is
const Bytes kEndsWithinANumber{0, 1, 0, 0, 0xff, 0xff};

template <class PubSubType>
Bytes bytes_of(typename PubSubType::type message) {
  PubSubType type;
  SerializedPayload_t payload(type.getSerializedSizeProvider(&message)());
  EXPECT_TRUE(type.serialize(&message, &payload));
  return {payload.data, payload.data + payload.length};
}

TEST(DamagedPayloads, AreCountedAndEndNothing) {
  const TestDomain domain;
  const auto hostile = test_participant(domain), bus = test_participant(domain);
  HealthWatch health(bus);
  RobotSender robot(bus, "robot1", true);
  FrameWatch frames(bus);
  namespace t = dds::topics;
  const BytesWriter depth(hostile, t::kDepth, "rt/robot1/depth/image_raw");
  const BytesWriter labels(hostile, t::kSegmentation, "rt/robot1/segmentation");
  const BytesWriter info(hostile, t::kCameraInfo, "rt/robot1/depth/camera_info");
  const BytesWriter odometry(hostile, t::kOdometry, "rt/robot1/odom");
  const BytesWriter tf(hostile, t::kTf, "rt/tf");
  const BytesWriter request(hostile, t::kSnapshotRequest, t::kSnapshotRequest.name);
  const BytesWriter clock(hostile, t::kClock, t::kClock.name);
  const BytesWriter manifest(hostile, t::kMapManifest, t::kMapManifest.name);
  const BytesWriter tf_static(hostile, t::kTfStatic, "rt/tf_static");  // last, see below
  const BytesWriter* all[] = {&depth,     &labels,  &info,  &odometry, &tf,
                              &tf_static, &request, &clock, &manifest};
  Process node(node_command(domain, {"--set", "node.use_clock=true"}));
  ASSERT_TRUE(eventually([&] {
    return health.newest() != nullptr && robot.matched() && frames.matched() &&
           std::all_of(std::begin(all), std::end(all), [](auto* w) { return w->matched() > 0; });
  }));
  // That a writer is matched says nothing of its reader, and one that is not reliable would miss
  // what comes before it has found the writer.
  tf_static.send(bytes_of<tf2_msgs::msg::TFMessagePubSubType>({}));
  ASSERT_TRUE(tf_static.acknowledged());
  const auto count = [&](const BytesWriter& writer) {
    return health.problem(writer.topic(), "damaged");
  };
  for (const BytesWriter* writer : all) writer->send(kNoEncapsulation);
  // Their readers keep one sample only.
  for (const BytesWriter* writer : {&clock, &manifest}) {
    EXPECT_TRUE(eventually([&] { return count(*writer) == 1; })) << writer->topic();
  }
  for (const BytesWriter* writer : all) writer->send(kEndsWithinANumber);
  // A boolean of many a driver that does not set it.
  Bytes neither = bytes_of<sensor_msgs::msg::CameraInfoPubSubType>(
      dds::camera_message({30, 20, 40, 40, 15, 10}, 5, "camera"));
  neither.back() = 0x5a;
  info.send(neither);
  // A million transforms that are not there.
  Bytes many(2'000'000, 0);
  many[1] = 1;
  many[6] = 0x10;
  tf.send(many);
  for (const BytesWriter* writer :
       {&depth, &labels, &odometry, &tf_static, &request, &clock, &manifest}) {
    EXPECT_TRUE(eventually([&] { return count(*writer) == 2; })) << writer->topic();
  }
  EXPECT_TRUE(eventually([&] { return count(info) == 3; }));
  EXPECT_TRUE(eventually([&] { return count(tf) == 3; }));

  StampNs stamp_ns = 0;
  EXPECT_TRUE(eventually([&] {
    robot.send_frame(stamp_ns += 50'000'000);
    return frames.processed("robot1") > 0;
  })) << "it goes on";
  node.signal(SIGTERM);
  const CommandResult result = node.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

// The libraries that other applications link.
TEST(DamagedPayloads, AreCountedByMirrorsAndEndNoWatch) {
  const TestDomain domain;
  const auto hostile = test_participant(domain), bus = test_participant(domain);
  MirrorOptions mirror_options;
  mirror_options.domain = domain.number();
  const MapMirror mirror(mirror_options);
  std::atomic<int> heard{0};
  ObjectWatchOptions watch_options;
  watch_options.domain = domain.number();
  watch_options.on_event = [&](const ObjectEvent&, const std::string&) { ++heard; };
  const ObjectWatch watch(watch_options);
  namespace t = dds::topics;
  const BytesWriter deltas(hostile, t::kMapDeltas, t::kMapDeltas.name);
  const BytesWriter objects(hostile, t::kObjects, t::kObjects.name);
  const BytesWriter manifest(hostile, t::kMapManifest, t::kMapManifest.name);
  const BytesWriter events(hostile, t::kObjectEvents, t::kObjectEvents.name);
  dds::Writer<pocd_msgs::msg::ObjectEventPubSubType> good(bus, t::kObjectEvents);
  ASSERT_TRUE(eventually([&] {
    return deltas.matched() == 1 && objects.matched() == 2 && manifest.matched() == 2 &&
           events.matched() == 2 && good.matched() == 2;
  }));
  for (const BytesWriter* writer : {&deltas, &objects, &manifest, &events}) {
    writer->send(kEndsWithinANumber);
  }
  EXPECT_TRUE(
      mirror.wait_until([](const MirrorStatus& status) { return status.corrupt == 4; }, kGenerous))
      << mirror.status().corrupt;
  pocd_msgs::msg::ObjectEvent event;
  EXPECT_TRUE(good.write(event));
  EXPECT_TRUE(eventually([&] { return heard == 1; })) << "it goes on";
}

TEST(GuardedType, ASequenceHasToFitIntoItsPayload) {
  const auto holds = [](Bytes bytes, std::uint32_t element) {
    SerializedPayload_t payload;  // does not own what it is given
    payload.data = bytes.data();
    payload.length = static_cast<std::uint32_t>(bytes.size());
    const bool good = dds::holds_its_sequence(payload, element);
    payload.data = nullptr;
    return good;
  };
  const auto of = [](bool little, std::uint8_t count, std::size_t bytes) {
    Bytes payload{0, little, 0, 0, 0, 0, 0, 0};
    payload[little ? 4 : 7] = count;
    payload.resize(8 + bytes);
    return payload;
  };
  for (const bool little : {true, false}) {
    EXPECT_TRUE(holds(of(little, 0, 0), 72));
    EXPECT_TRUE(holds(of(little, 2, 144), 72));
    EXPECT_FALSE(holds(of(little, 2, 143), 72)) << "one too many";
    EXPECT_FALSE(holds(of(little, 3, 144), 72)) << "one too many";
    Bytes huge = of(little, 1, 1000);
    huge[little ? 7 : 4] = 0x80;  // the highest byte of the number
    EXPECT_FALSE(holds(huge, 1));
  }
  EXPECT_FALSE(holds({0, 1, 0, 0, 0, 0, 0}, 72)) << "not even a number";
  EXPECT_FALSE(holds({}, 72));
}

TEST(GuardedType, MakesNoRoomForTransformsThatAreNotThere) {
  Bytes many(2'000'000, 0);
  many[1] = 1;
  many[6] = 0x10;
  SerializedPayload_t payload(static_cast<std::uint32_t>(many.size()));
  std::copy(many.begin(), many.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(many.size());
  dds::GuardedType<tf2_msgs::msg::TFMessagePubSubType> type;
  tf2_msgs::msg::TFMessage message;
  EXPECT_FALSE(type.deserialize(&payload, &message));
  EXPECT_EQ(message.transforms().capacity(), 0u);
}

// A mistake of ours in the middle of the middleware is no damage of the sender's.
TEST(ImageVisit, BringsOutWhatTheVisitorThrows) {
  Bytes bytes = bytes_of<sensor_msgs::msg::ImagePubSubType>(
      dds::image_message(cv::Mat(2, 3, CV_16UC1, cv::Scalar(7)), "16UC1", 5, "camera"));
  SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  dds::ImageVisit visit{[](const recording::RosImage&) { throw std::logic_error("broken"); }};
  dds::GuardedType<dds::ImageVisitType> type;
  const std::uint64_t before = dds::damaged_payloads();
  EXPECT_TRUE(type.deserialize(&payload, &visit)) << "the payload is good";
  EXPECT_EQ(dds::damaged_payloads(), before);
  EXPECT_THROW(visit.rethrow(), std::logic_error);
  EXPECT_NO_THROW(visit.rethrow()) << "once";
}

// That is how a slow node holds a player back.
TEST(Reader, WhatItHasNoRoomForComesAgainAndIsNotLost) {
  talk_over_the_bus();  // the short cut within a process does not come again
  const TestDomain domain;
  dds::Wakeup wakeup;
  constexpr int kSent = 40;
  const dds::Delivery few{true, false, 0, 8, 0, false, 0}, all{true, false, 0, 100, 0, false, 0};
  dds::Reader<nav_msgs::msg::OdometryPubSubType> reader(
      test_participant(domain), dds::topics::kOdometry, "rt/r/odom", few, wakeup);
  dds::Writer<nav_msgs::msg::OdometryPubSubType> writer(test_participant(domain),
                                                        dds::topics::kOdometry, "rt/r/odom", all);
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0 && reader.matched() > 0; }));
  for (int i = 0; i < kSent; ++i) {
    auto message = dds::odometry_message({"map", "base", i, {}});
    EXPECT_TRUE(writer.write(message));
  }
  nav_msgs::msg::Odometry message;
  dds::SampleMeta meta;
  StampNs next = 0;
  EXPECT_TRUE(eventually([&] {
    if (reader.unread() < 8 && next < kSent - 8) return false;  // full, or these are the last
    if (reader.take(message, meta)) {
      EXPECT_EQ(dds::to_stamp(message.header().stamp()), next++);
    }
    return next == kSent;
  }));
  EXPECT_TRUE(writer.wait_acknowledged(kGenerous));
  EXPECT_EQ(reader.lost(), 0u);
}

TEST(Reader, TakesSomeAndComesBackForTheRest) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  dds::Wakeup wakeup;
  dds::Reader<nav_msgs::msg::OdometryPubSubType> reader(bus, dds::topics::kOdometry, "rt/r/odom",
                                                        kTestDelivery, wakeup);
  dds::Writer<nav_msgs::msg::OdometryPubSubType> writer(bus, dds::topics::kOdometry, "rt/r/odom",
                                                        kTestDelivery);
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0; }));
  for (int i = 0; i < 5; ++i) {
    auto message = dds::odometry_message({"map", "base", i, {}});
    EXPECT_TRUE(writer.write(message));
  }
  ASSERT_TRUE(writer.wait_acknowledged(kGenerous));
  int taken = 0;
  const auto turn = [&] {
    wakeup.wait_for(kGenerous);
    reader.take_some(2, [&](const auto&, const dds::SampleMeta&) { ++taken; });
  };
  for (const int expected : {2, 4, 5}) {
    turn();
    EXPECT_EQ(taken, expected);
  }
}

}  // namespace
}  // namespace pocd

// Payloads that are no messages: counted by topic, and nothing ends for them.
#include <gtest/gtest.h>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>

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
      : topic_(topic) {
    dds::Delivery delivery = spec.delivery;
    delivery.reliable = true;
    delivery.keep_last = 200;
    delivery.max_instances = 0;
    writer_ = bus->publisher()->create_datawriter(
        bus->topic(topic,
                   eprosima::fastdds::dds::TypeSupport(new BytesType(spec.type, spec.keyed))),
        bus->writer_qos(topic, delivery), nullptr);
  }
  const std::string& topic() const { return topic_; }
  bool matched() const {
    eprosima::fastdds::dds::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return status.current_count > 0;
  }
  void send(Bytes bytes) const { EXPECT_TRUE(writer_->write(&bytes)) << topic_; }
  /// Whoever acknowledges has found all writers of this participant that were made before this one:
  /// they are announced in the order of their making.
  bool acknowledged() const {
    return writer_->wait_for_acknowledgments({120, 0}) ==
           eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
  }

 private:
  std::string topic_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;  // its participant deletes it
};

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
  const BytesWriter tf(hostile, t::kTf, "rt/tf"), tf_static(hostile, t::kTfStatic, "rt/tf_static");
  const BytesWriter request(hostile, t::kSnapshotRequest, t::kSnapshotRequest.name);
  const BytesWriter clock(hostile, t::kClock, t::kClock.name);
  const BytesWriter manifest(hostile, t::kMapManifest, t::kMapManifest.name);
  const BytesWriter* all[] = {&depth,     &labels,  &info,  &odometry, &tf,
                              &tf_static, &request, &clock, &manifest};
  Process node(node_command(domain, {"--set", "node.use_clock=true"}));
  ASSERT_TRUE(eventually([&] {
    return health.newest() != nullptr && robot.matched() && frames.matched() &&
           std::all_of(std::begin(all), std::end(all), [](auto* w) { return w->matched(); });
  }));
  // That a writer is matched says nothing of its reader, and one that is not reliable would miss
  // what comes before it has found the writer.
  tf_static.send(bytes_of<tf2_msgs::msg::TFMessagePubSubType>({}));
  ASSERT_TRUE(tf_static.acknowledged());
  for (const BytesWriter* writer : all) {
    writer->send({0x77, 0x77, 0, 0, 1, 2, 3, 4});  // no encapsulation that there is
    writer->send({0, 1, 0, 0, 0xff, 0xff});        // ends within a number
  }
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
  const auto count = [&](const BytesWriter& writer) {
    return health.problem(writer.topic(), "damaged");
  };
  for (const BytesWriter* writer : {&depth, &labels, &odometry, &tf_static}) {
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

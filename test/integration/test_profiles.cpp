// What an operator's XML profiles replace, and the check of the machine's socket buffers.
#include <gtest/gtest.h>
#include <malloc.h>

#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fstream>

#include "bus_harness.hpp"
#include "diagnostic_msgsPubSubTypes.h"
#include "nav_msgsPubSubTypes.h"
#include "pocd/common/check.hpp"
#include "pocd_dds/entities/socket_buffers.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "sensor_msgsPubSubTypes.h"

namespace pocd {
namespace {

using namespace eprosima::fastdds::dds;  // NOLINT: settings of Fast DDS are the subject

TEST(Profiles, ReplaceParticipantReadersAndWriters) {
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto file = folder.path() / "profiles.xml";
  std::ofstream(file) << R"(<?xml version="1.0" encoding="UTF-8" ?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors>
    <transport_descriptor><transport_id>small_udp</transport_id><type>UDPv4</type>
      <maxMessageSize>8972</maxMessageSize></transport_descriptor>
  </transport_descriptors>
  <participant profile_name="operator" is_default_profile="true"><rtps>
    <name>named_by_the_operator</name>
    <builtin><discovery_config><leaseDuration><sec>17</sec></leaseDuration></discovery_config></builtin>
    <userTransports><transport_id>small_udp</transport_id></userTransports>
    <useBuiltinTransports>false</useBuiltinTransports>
  </rtps></participant>
  <data_writer profile_name="pocd/object_events"><historyMemoryPolicy>DYNAMIC</historyMemoryPolicy>
    <topic><historyQos><kind>KEEP_LAST</kind><depth>77</depth></historyQos></topic>
    <times><heartbeatPeriod><sec>2</sec></heartbeatPeriod></times></data_writer>
  <data_reader profile_name="rt/robot1/depth/image_raw">
    <qos><reliability><kind>RELIABLE</kind></reliability></qos></data_reader>
</profiles>)";
  const auto find = [](const DomainParticipantQos& qos) {
    return qos.wire_protocol().builtin.discovery_config.leaseDuration.seconds;
  };
  {
    const dds::Participant plain({domain.number(), "", "plain"});
    DomainParticipantQos qos;
    plain.get()->get_qos(qos);
    EXPECT_EQ(std::string(qos.name().c_str()), "plain");
    EXPECT_EQ(find(qos), 5) << "a process that dies is noticed soon";
    EXPECT_EQ(qos.transport().user_transports.size(), 2u);
  }
  const dds::Participant participant({domain.number(), file.string(), "ours"});
  DomainParticipantQos qos;
  participant.get()->get_qos(qos);
  EXPECT_EQ(std::string(qos.name().c_str()), "named_by_the_operator");
  EXPECT_EQ(find(qos), 17);
  ASSERT_EQ(qos.transport().user_transports.size(), 1u);
  EXPECT_EQ(qos.transport().user_transports[0]->max_message_size(), 8972u);

  const auto& events = dds::topics::kObjectEvents;
  const DataWriterQos writer = participant.writer_qos(events.name, events.delivery);
  EXPECT_EQ(writer.history().depth, 77);
  EXPECT_EQ(writer.reliable_writer_qos().times.heartbeatPeriod.seconds, 2);
  EXPECT_EQ(participant.reader_qos(events.name, events.delivery).history().depth, 1000)
      << "a profile for writers is none for readers";
  const auto& depth = dds::topics::kDepth;
  EXPECT_EQ(participant.reader_qos("rt/robot1/depth/image_raw", depth.delivery).reliability().kind,
            RELIABLE_RELIABILITY_QOS);
  EXPECT_EQ(participant.reader_qos("rt/robot2/depth/image_raw", depth.delivery).reliability().kind,
            BEST_EFFORT_RELIABILITY_QOS);
  const auto& tiles = dds::topics::kMapTiles;
  EXPECT_EQ(participant.writer_qos(tiles.name, tiles.delivery).publish_mode().kind,
            ASYNCHRONOUS_PUBLISH_MODE)
      << "topics without a profile stay as the table has them";
}

TEST(Profiles, ALimitThatTheyDoNotNameIsTheTables) {
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto file = folder.path() / "profiles.xml";
  std::ofstream(file) << R"(<?xml version="1.0" encoding="UTF-8" ?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <data_writer profile_name="pocd/objects"><topic>
    <resourceLimitsQos><max_samples>30000</max_samples></resourceLimitsQos></topic></data_writer>
</profiles>)";
  const dds::Participant participant({domain.number(), file.string(), "ours"});
  const auto& objects = dds::topics::kObjects;
  const DataWriterQos qos = participant.writer_qos(objects.name, objects.delivery);
  EXPECT_EQ(qos.resource_limits().max_samples, 30000);
  EXPECT_EQ(qos.resource_limits().max_instances, objects.delivery.max_instances);
}

TEST(Participant, ATopicGoesWithItsLastUser) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  using Odometry = nav_msgs::msg::OdometryPubSubType;
  using Image = sensor_msgs::msg::ImagePubSubType;
  const auto odometry = [&] {
    return std::make_unique<dds::Writer<Odometry>>(bus, dds::topics::kOdometry, "rt/x",
                                                   dds::topics::best_effort(1));
  };
  const auto image = [&] {
    return std::make_unique<dds::Writer<Image>>(bus, dds::topics::kDepth, "rt/x",
                                                dds::topics::best_effort(1));
  };
  {
    const auto one = odometry(), other = odometry();
    EXPECT_THROW(image(), InputError);
  }
  {
    const auto one = image();
    EXPECT_THROW(odometry(), InputError);
  }
  // A topic that cannot go, because something was left on it, can be used again.
  DataWriter* left = nullptr;
  {
    const auto use = bus->topic("rt/x", TypeSupport(new dds::GuardedType<Image>()));
    left = bus->publisher()->create_datawriter(use.get(), DATAWRITER_QOS_DEFAULT);
  }
  EXPECT_NO_THROW(image());
  bus->publisher()->delete_datawriter(left);
}

// Preallocated, a sample would have the largest size of its type, 5 MB. The writer keeps up to ten;
// one here, where nobody reads.
TEST(Participant, SamplesOfAWriterTakeNoMoreThanTheyNeed) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "a sanitizer has a heap of its own";
#endif
  const TestDomain domain;
  const auto bus = test_participant(domain);
  const auto in_use = [] {
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
  };
  const std::size_t before = in_use();
  dds::Writer<diagnostic_msgs::msg::DiagnosticArrayPubSubType> writer(bus,
                                                                      dds::topics::kDiagnostics);
  diagnostic_msgs::msg::DiagnosticArray sample;
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(writer.write(sample));
  EXPECT_LT(in_use(), before + (4u << 20));
}

// What says nothing of sizes has the kernel's: most images of a robot are lost then.
TEST(Profiles, BuffersThatTheyLeaveSmallAreNamed) {
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto says_so = [&](const std::string& sizes) {
    const auto file = folder.path() / "profiles.xml";
    std::ofstream(file) << R"(<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <transport_descriptors><transport_descriptor>
    <transport_id>udp</transport_id><type>UDPv4</type>)"
                        << sizes << R"(
  </transport_descriptor></transport_descriptors>
  <participant profile_name="udp" is_default_profile="true"><rtps>
    <userTransports><transport_id>udp</transport_id></userTransports>
    <useBuiltinTransports>false</useBuiltinTransports>
  </rtps></participant></profiles></dds>)";
    Process node(node_command(domain, {"--profiles", file.string()}));
    EXPECT_TRUE(eventually([&] {
      return node.err().find("running on domain") != std::string::npos;
    })) << node.err();
    return node.err().find("set receiveBufferSize and sendBufferSize") != std::string::npos;
  };
  EXPECT_TRUE(says_so(""));
  EXPECT_TRUE(says_so("<receiveBufferSize>65536</receiveBufferSize>"));
  EXPECT_FALSE(
      says_so("<sendBufferSize>4194304</sendBufferSize>"
              "<receiveBufferSize>4194304</receiveBufferSize>"));
}

// By such transports a discovery that hangs would not be noticed.
TEST(Profiles, TransportsThatAreNotWatchedAreNamed) {
  const TestDomain domain;
  const TemporaryFolder folder;
  const auto said = [&](const std::string& type, const std::string& builtin) {
    const auto file = folder.path() / "profiles.xml";
    std::ofstream(file) << R"(<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <transport_descriptors><transport_descriptor><transport_id>own</transport_id><type>)"
                        << type << R"(</type></transport_descriptor></transport_descriptors>
  <participant profile_name="own" is_default_profile="true"><rtps>
    <userTransports><transport_id>own</transport_id></userTransports>
    <useBuiltinTransports>)"
                        << builtin << R"(</useBuiltinTransports>
  </rtps></participant></profiles></dds>)";
    Process node(node_command(domain, {"--profiles", file.string()}));
    EXPECT_TRUE(eventually([&] {
      return node.err().find("running on domain") != std::string::npos;
    })) << node.err();
    const std::string before = "the profile of the participant uses ", text = node.err();
    const std::size_t at = text.find(before);
    if (at == std::string::npos) return std::string();
    EXPECT_EQ(text.find(before, at + 1), std::string::npos) << "once: " << text;
    return text.substr(at + before.size(), text.find(':', at) - at - before.size());
  };
  EXPECT_EQ(said("UDPv4", "false"), "");
  EXPECT_EQ(said("UDPv4", "true"), "the transports of useBuiltinTransports");
  EXPECT_EQ(said("TCPv4", "true"), "TCP, the transports of useBuiltinTransports");
}

TEST(SocketBuffers, SayWhatToSetWhenTheyAreSmall) {
  EXPECT_EQ(dds::socket_buffer_problem(4096), "");
  const std::string problem = dds::socket_buffer_problem(1 << 30);
  EXPECT_NE(problem.find("sysctl -w net.core.rmem_max=1073741824"), std::string::npos) << problem;
  EXPECT_NE(problem.find("sysctl -w net.core.wmem_max=1073741824"), std::string::npos) << problem;
}

}  // namespace
}  // namespace pocd

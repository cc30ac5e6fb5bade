// Two sides that were built from different IDL, and two forms of one type in one process.
#include <gtest/gtest.h>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include "bus_harness.hpp"
#include "pocd/common/check.hpp"
#include "pocd_dds/bridge/image_visit.hpp"
#include "pocd_dds/entities/idl_version.hpp"
#include "pocd_dds/entities/known_types.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "sensor_msgsPubSubTypes.h"

namespace pocd {
namespace {

using Manifest = pocd_msgs::msg::MapManifestPubSubType;
namespace t = dds::topics;

TEST(IdlVersion, ChangesWithAnyFieldOfTheTypeAndOfTypesWithin) {
  const auto files = dds::embedded_idl();
  const auto versions = [&](const std::string& from, const std::string& to) {
    auto changed = files;
    std::string& text = changed.at("pocd_msgs.idl");
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
    std::vector<std::string> all;
    for (const dds::TopicSpec& spec : {t::kObjects, t::kObjectEvents, t::kMapTiles, t::kHealth}) {
      all.push_back(dds::idl_version(spec.type, changed));
    }
    return all;
  };
  const auto own = versions("octet lifecycle;", "octet lifecycle;");
  for (const std::string& version : own) EXPECT_EQ(version.size(), 16u);
  EXPECT_EQ(dds::idl_version(t::kObjects.type), own[0]);
  const auto differ = [&](const std::vector<std::string>& other) {
    std::string text;
    for (std::size_t i = 0; i < own.size(); ++i) text += own[i] == other[i] ? '-' : 'x';
    return text;
  };
  EXPECT_EQ(differ(versions("// 1 present.", "// Something else.")), "----") << "a comment";
  EXPECT_EQ(differ(versions("octet lifecycle;", "octet life_cycle;")), "x---");
  EXPECT_EQ(differ(versions("octet lifecycle;", "unsigned long lifecycle;")), "x---");
  EXPECT_EQ(differ(versions("double yaw;", "")), "xx--") << "of a box, within both";
  EXPECT_EQ(differ(versions("unsigned long crc;", "")), "--x-");
  EXPECT_EQ(dds::idl_version(t::kDepth.type), "") << "a type of ROS has no version here";
}

TEST(IdlVersion, IsReadFromWhatIsAnnounced) {
  EXPECT_EQ(dds::announced_idl(dds::idl_announcement(t::kObjects.type)),
            dds::idl_version(t::kObjects.type));
  EXPECT_TRUE(dds::idl_announcement(t::kDepth.type).empty());
  const auto read = [](const std::string& text) {
    return dds::announced_idl({text.begin(), text.end()});
  };
  EXPECT_EQ(read("a=b;pocd_idl=12;"), "12");
  for (const char* without : {"", "a=b;", "pocd_idl=12", "pocd_idl="}) EXPECT_FALSE(read(without));
  EXPECT_EQ(read("pocd_idl=" + std::string(1000, 'x') + ";")->size(), 16u);
}

/// Writes manifests, and says that its type is another one.
struct WriterOfAnotherVersion {
  explicit WriterOfAnotherVersion(const TestDomain& domain)
      : participant(std::make_shared<dds::Participant>(
            dds::BusOptions{domain.number(), "", "of_last_year"})),
        topic(participant->topic(t::kMapManifest.name, eprosima::fastdds::dds::TypeSupport(
                                                           new dds::GuardedType<Manifest>()))) {
    auto qos = participant->writer_qos(t::kMapManifest.name, t::kMapManifest.delivery);
    const std::string said = "pocd_idl=0123456789abcdef;";
    qos.user_data().data_vec({said.begin(), said.end()});
    writer = participant->publisher()->create_datawriter(topic.get(), qos);
  }
  ~WriterOfAnotherVersion() { participant->publisher()->delete_datawriter(writer); }
  void write() {
    pocd_msgs::msg::MapManifest manifest;
    manifest.epoch(7);
    EXPECT_TRUE(writer->write(&manifest));
  }

  std::shared_ptr<dds::Participant> participant;
  std::shared_ptr<eprosima::fastdds::dds::Topic> topic;
  eprosima::fastdds::dds::DataWriter* writer = nullptr;
};

TEST(IdlVersion, SamplesOfAnotherAreRefusedByName) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  HealthWatch health(bus);
  MirrorOptions options;
  options.domain = domain.number();
  options.map_id = 0;
  MapMirror mirror(options);
  Process node(node_command(domain, {"--set", "node.map_id=4", "--epoch", "9"}));
  WriterOfAnotherVersion other(domain);
  other.write();
  const std::string refusal =
      "participant \"of_last_year\" has version 0123456789abcdef of type "
      "pocd_msgs::msg::dds_::MapManifest_, this one " +
      dds::idl_version(t::kMapManifest.type);
  EXPECT_TRUE(mirror.wait_until(
      [&](const MirrorStatus& status) {
        return status.stale_because.find("pocd/map/manifest: " + refusal) == 0;
      },
      kGenerous))
      << mirror.status().stale_because;
  EXPECT_FALSE(mirror.status().publisher_seen);
  EXPECT_GT(mirror.status().corrupt, 0u);
  EXPECT_TRUE(eventually([&] {
    return health.newest() && health.problem(t::kMapManifest.name, "other_idl") > 0;
  })) << node.err();
  EXPECT_NE(node.err().find(refusal), std::string::npos) << node.err();

  // It goes, and one that fits is heard on the same topic.
  dds::Writer<Manifest> fitting(test_participant(domain), t::kMapManifest);
  pocd_msgs::msg::MapManifest manifest;
  manifest.epoch(8);
  EXPECT_TRUE(fitting.write(manifest));
  EXPECT_TRUE(
      mirror.wait_until([](const MirrorStatus& status) { return status.epoch == 8; }, kGenerous));
}

// The middleware knows types by name: the second form would be dropped without a word, and what is
// written with it never leave.
TEST(Participant, RefusesTwoFormsOfOneType) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  dds::Wakeup wakeup;
  const dds::Reader<dds::ImageVisitType> visits(bus, t::kDepth, "rt/a/depth", t::kDepth.delivery,
                                                wakeup);
  const auto message = [&](const std::string& topic) -> std::string {
    try {
      const dds::Writer<sensor_msgs::msg::ImagePubSubType> writer(bus, t::kDepth, topic,
                                                                  t::kDepth.delivery);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message("rt/b/depth")
                .rfind("topic rt/b/depth: this participant uses type "
                       "sensor_msgs::msg::dds_::Image_ in another form",
                       0),
            0u);
  EXPECT_NE(message("rt/a/depth"), "") << "on the same topic, too";
  const dds::Reader<dds::ImageVisitType> again(bus, t::kDepth, "rt/c/depth", t::kDepth.delivery,
                                               wakeup);
  const auto other = test_participant(domain);
  EXPECT_NO_THROW((dds::Writer<sensor_msgs::msg::ImagePubSubType>(other, t::kDepth, "rt/a/depth",
                                                                  t::kDepth.delivery)));
}

}  // namespace
}  // namespace pocd

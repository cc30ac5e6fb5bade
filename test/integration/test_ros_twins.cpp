// Objects, events and health as ROS 2 takes them: unkeyed, with messages of pocd_interfaces; and
// the component in ROS 2's graph. The readers here ask for what those of ROS 2 do; peers_cyclone
// has another vendor's.
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>
#include <sstream>

#include "over_the_bus.hpp"
#include "pocd/recording/idl_schema.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "renamed_reader.hpp"
#include "rmw_dds_commonPubSubTypes.h"
#include "whole_run.hpp"

namespace pocd {
namespace {

using Uuid = std::array<std::uint8_t, 16>;

std::filesystem::path shared() {
  return std::filesystem::path(POCD_BIN_DIR) / "../share/pocd_msgs";
}
std::filesystem::path package() { return shared() / "pocd_interfaces"; }

/// "msg/ObjectList.msg" as lines "type name", types as they are written there.
std::vector<std::string> fields_of(const std::filesystem::path& file) {
  std::vector<std::string> fields;
  std::istringstream lines(read_text(file));
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line[0] != '#') fields.push_back(line);
  }
  return fields;
}

/// The same of a type of pocd_msgs, as its IDL has it. Types of the same package stand without it.
std::vector<std::string> fields_of(const recording::IdlLibrary& library, const std::string& name) {
  const std::string text = library.ros2msg("pocd_msgs::msg::" + name).text;
  const std::string own = text.substr(0, text.find(std::string(80, '=')));
  std::vector<std::string> fields;
  std::istringstream lines(std::regex_replace(own, std::regex("^pocd_msgs/|\npocd_msgs/"), "\n"));
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) fields.push_back(line);
  }
  return fields;
}

TEST(RosInterfaces, AgreeWithTheIdlFieldByField) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(source("pocd_msgs/idl"))) {
    files[entry.path().filename().string()] = read_text(entry.path());
  }
  const recording::IdlLibrary library(files);
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(package() / "msg")) {
    const std::string name = entry.path().stem().string();
    names.insert(name);
    ASSERT_TRUE(library.has("pocd_msgs::msg::" + name)) << name;
    EXPECT_EQ(fields_of(entry.path()), fields_of(library, name)) << name;
    EXPECT_NE(read_text(package() / "CMakeLists.txt").find("msg/" + name + ".msg"),
              std::string::npos)
        << name;
  }
  for (const char* name :
       {"ObjectList", "ObjectRemoval", "ObjectState", "ObjectEvent", "NodeHealth"})
    EXPECT_EQ(names.count(name), 1u) << name;
  EXPECT_NE(read_text(package() / "package.xml").find("<name>pocd_interfaces</name>"),
            std::string::npos);
}

// rosidl, as ROS 2 has it, turns them into IDL and reads that.
TEST(RosInterfaces, AreReadByRosidl) {
  if (run_command({"/usr/bin/python3", "-c", "import rosidl_adapter.msg, rosidl_parser.parser"})
          .exit_code != 0) {
    GTEST_SKIP() << "python3-rosidl and python3-empy are not installed";
  }
  const TemporaryFolder folder;
  const std::string program =
      "import pathlib, sys\n"
      "from rosidl_adapter.msg import convert_msg_to_idl\n"
      "from rosidl_parser.definition import IdlLocator\n"
      "from rosidl_parser.parser import parse_idl_file\n"
      "package, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])\n"
      "for file in sorted((package / 'msg').glob('*.msg')):\n"
      "  convert_msg_to_idl(package, 'pocd_interfaces', pathlib.Path('msg') / file.name, out / "
      "'msg')\n"
      "  parse_idl_file(IdlLocator(out, pathlib.Path('msg') / (file.stem + '.idl')))\n"
      "  print('read', file.stem)\n";
  const CommandResult read =
      run_command({"/usr/bin/python3", "-c", program, package().string(), folder.path().string()});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_EQ(count_of(read.out, "read "),
            static_cast<std::size_t>(
                std::distance(std::filesystem::directory_iterator(package() / "msg"), {})))
      << read.out;
}

/// Takes the twins as a node of ROS 2 would.
class RosNode {
 public:
  explicit RosNode(const std::shared_ptr<dds::Participant>& bus, const std::string& in = "pocd")
      : lists_(bus, dds::topics::kRosObjects, taker_.wakeup(), "rt/" + in + "/objects"),
        events_(bus, dds::topics::kRosObjectEvents, taker_.wakeup(), "rt/" + in + "/object_events"),
        healths_(bus, dds::topics::kRosHealth, taker_.wakeup(), "rt/" + in + "/health") {
    taker_.start([this] { take(); });
  }
  // The readers go before the thread that takes from them.
  ~RosNode() { stop(); }
  int matched() const {
    return (lists_.matched() > 0) + (events_.matched() > 0) + (healths_.matched() > 0);
  }
  void stop() { taker_.stop(); }

  std::vector<pocd_msgs::msg::ObjectList> lists;
  std::vector<pocd_msgs::msg::ObjectEvent> events;
  std::vector<pocd_msgs::msg::NodeHealth> healths;

 private:
  void take() {
    dds::SampleMeta meta;
    for (pocd_msgs::msg::ObjectList list; lists_.take(list, meta);) lists.push_back(list);
    for (pocd_msgs::msg::ObjectEvent event; events_.take(event, meta);) events.push_back(event);
    for (pocd_msgs::msg::NodeHealth health; healths_.take(health, meta);) healths.push_back(health);
  }

  Taker taker_;
  RenamedReader<pocd_msgs::msg::ObjectListPubSubType> lists_;
  RenamedReader<pocd_msgs::msg::ObjectEventPubSubType> events_;
  RenamedReader<pocd_msgs::msg::NodeHealthPubSubType> healths_;
};

// One object is removed between the drives.
TEST(RosTwins, HaveObjectsRemovalsEventsAndHealth) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  RosNode ros(bus, "upper");
  MirrorOptions options;
  options.domain = domain.number();
  MapMirror mirror(options);
  Process node(node_command(domain, {"--lossless", "--set", "node.outputs.twins_hz=20", "--set",
                                     "node.outputs.namespace=upper"}));
  ASSERT_TRUE(eventually([&] { return ros.matched() == 3; }));
  play_and_end(node, play_command(domain));
  ASSERT_TRUE(mirror.wait_until(
      [](const MirrorStatus& status) { return status.in_step && status.final_version; },
      kGenerous));
  ros.stop();
  const MirrorContents contents = mirror.contents();

  ASSERT_GT(ros.lists.size(), 2u);
  EXPECT_TRUE(ros.lists.front().objects().empty()) << "that nothing is there is said, too";
  for (std::size_t i = 1; i < ros.lists.size(); ++i) {
    EXPECT_GT(ros.lists[i].number(), ros.lists[i - 1].number());
  }
  const pocd_msgs::msg::ObjectList& last = ros.lists.back();
  EXPECT_EQ(last.header().frame_id(), "map");
  std::set<std::uint32_t> listed, known, there_once, removed;
  for (const auto& object : last.objects()) listed.insert(object.local_id());
  for (const ObjectSnapshot& object : contents.objects)
    known.insert(static_cast<std::uint32_t>(to_index(object.id)));
  EXPECT_EQ(listed, known);
  for (const auto& list : ros.lists) {
    for (const auto& object : list.objects()) there_once.insert(object.local_id());
  }
  for (const auto& removal : last.removed()) {
    removed.insert(removal.local_id());
    EXPECT_FALSE(removal.forgotten());
    EXPECT_EQ(there_once.count(removal.local_id()), 1u);
    EXPECT_EQ(listed.count(removal.local_id()), 0u);
  }
  EXPECT_EQ(removed.size(), 1u);

  std::multiset<int> kinds;
  for (std::size_t i = 0; i < ros.events.size(); ++i) {
    EXPECT_EQ(ros.events[i].seq(), i + 1);
    kinds.insert(ros.events[i].kind());
  }
  EXPECT_EQ(kinds.count(3), 1u) << "removed";
  ASSERT_FALSE(ros.healths.empty());
  EXPECT_EQ(ros.healths.back().message(), "stopped");
  EXPECT_EQ(ros.healths.back().objects(), listed.size());
}

TEST(RosTwins, AreOffUnlessAskedFor) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  RosNode ros(bus);
  HealthWatch health(bus);
  Process node(node_command(domain));
  // The node makes the writer of its health after those of objects and events.
  ASSERT_TRUE(eventually([&] { return health.newest() != nullptr; }));
  EXPECT_EQ(ros.matched(), 0);
}

/// The node `name` of the graph and all that it says of itself.
template <class Type>
void check_graph(const std::string& release) {
  SCOPED_TRACE(release);
  const TestDomain domain;
  const auto bus = test_participant(domain);
  dds::Wakeup wakeup;
  RenamedReader<Type> graph(bus, dds::topics::kRosGraph, wakeup);
  RenamedReader<pocd_msgs::msg::NodeHealthPubSubType> healths(bus, dds::topics::kRosHealth, wakeup);
  Process node(node_command(
      domain, {"--set", "node.outputs.ros_node=/site/pocd", "--set", "node.outputs.twins_hz=1",
               "--set", "node.outputs.ros_release=" + release}));
  typename Type::type info;
  dds::SampleMeta meta, health_meta;
  pocd_msgs::msg::NodeHealth health;
  ASSERT_TRUE(eventually([&] { return healths.take(health, health_meta); })) << node.err();
  // Said again when the robot's readers have been made.
  ASSERT_TRUE(eventually([&] {
    graph.take(info, meta);
    return info.node_entities_info_seq().size() == 1 &&
           info.node_entities_info_seq()[0].reader_gid_seq().size() >= 5;
  })) << node.err();
  const auto& said = info.node_entities_info_seq()[0];
  EXPECT_EQ(said.node_namespace(), "/site");
  EXPECT_EQ(said.node_name(), "pocd");
  const auto begins_with = [](const auto& gid, const auto& guid, std::size_t count) {
    return std::equal(guid.begin(), guid.begin() + static_cast<std::ptrdiff_t>(count),
                      gid.data().begin());
  };
  EXPECT_TRUE(begins_with(info.gid(), meta.writer, 12)) << "the prefix of its participant";
  EXPECT_EQ((std::array<int, 4>{info.gid().data()[12], info.gid().data()[13], info.gid().data()[14],
                                info.gid().data()[15]}),
            (std::array<int, 4>{0, 0, 1, 0xc1}))
      << "RTPS's number of a participant";
  EXPECT_TRUE(
      std::any_of(said.writer_gid_seq().begin(), said.writer_gid_seq().end(),
                  [&](const auto& gid) { return begins_with(gid, health_meta.writer, 16); }));
  for (const auto& gid : said.writer_gid_seq()) {
    for (std::size_t i = 16; i < gid.data().size(); ++i) EXPECT_EQ(gid.data()[i], 0);
  }
}

TEST(RosGraph, NamesTheNodeAndItsEndpoints) {
  check_graph<rmw_dds_common::msg::ParticipantEntitiesInfoPubSubType>("iron");
  check_graph<rmw_dds_common::msg::ParticipantEntitiesInfoHumblePubSubType>("humble");
}

TEST(RosGraph, BadNamesAreErrorsOfTheConfiguration) {
  for (const char* name : {"/", "a//b", "1a", "a b", "a/", "p/1"}) {
    const CommandResult result =
        run_command({bin("pocd_node"), "--config", source("config/simulated.yaml"), "--dump",
                     "--set", std::string("node.outputs.ros_node=") + name});
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_NE(result.err.find("ros_node"), std::string::npos) << name << result.err;
  }
}

}  // namespace
}  // namespace pocd

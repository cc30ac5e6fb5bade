// pocd_doctor: one line for everything that is wrong, and nothing when nothing is.
#include <gtest/gtest.h>
#include <sys/file.h>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include "robot_sender.hpp"

namespace pocd {
namespace {

constexpr StampNs kMs = 1'000'000;

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

/// A machine to the doctor's liking.
struct Machine {
  explicit Machine(const std::string& socket_bytes = "8388608") {
    for (const char* name : {"rmem_max", "wmem_max"}) {
      write_file(folder.path() / "proc/sys/net/core" / name, socket_bytes + "\n");
    }
    std::filesystem::create_directories(folder.path() / "shm");
  }
  std::filesystem::path shm() const { return folder.path() / "shm"; }
  std::vector<std::string> command(const TestDomain& domain,
                                   const std::vector<std::string>& more) const {
    std::vector<std::string> list{bin("pocd_doctor"),
                                  "--domain",
                                  domain.text(),
                                  "--proc",
                                  (folder.path() / "proc").string(),
                                  "--shm",
                                  shm().string()};
    list.insert(list.end(), more.begin(), more.end());
    return list;
  }
  TemporaryFolder folder;
};

/// Sends to the doctor, whose readers are best effort, until it has heard all of this, and then
/// asks it for what it has found.
CommandResult ask(Process& doctor, const std::function<void(StampNs)>& send,
                  const std::vector<std::string>& heard) {
  StampNs stamp_ns = 0;
  EXPECT_TRUE(eventually([&] {
    send(stamp_ns += 200 * kMs);
    const std::string said = doctor.err();
    return std::all_of(heard.begin(), heard.end(), [&](const std::string& line) {
      return said.find(line + "\n") != std::string::npos;
    });
  })) << doctor.err();
  doctor.signal(SIGINT);
  return doctor.wait();
}

TEST(Doctor, FindsNothingWhereNothingIsWrong) {
  const TestDomain domain;
  const Machine machine;
  const auto bus = test_participant(domain);
  // Two nodes with maps of their own are no mistake, but worth saying. A participant announces its
  // writers in the order of their making: who has heard of the robot has heard of these.
  dds::Writer<pocd_msgs::msg::ObjectStatePubSubType> upper(bus, dds::topics::kObjects),
      lower(bus, dds::topics::kObjects);
  RobotSender robot(bus, "robot1");
  Process doctor(machine.command(
      domain, {"--listen", "600", "--verbose", "--set", "node.segmentation=absent"}));
  const CommandResult result =
      ask(doctor, [&](StampNs t) { robot.send_frame(t); },
          {"robot1: first whole frame", "rt/robot1/depth/image_raw: is announced"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_NE(result.out.find("note: pocd/objects: 2 nodes publish objects"), std::string::npos)
      << result.out;
  EXPECT_NE(result.out.find("nothing wrong was found"), std::string::npos) << result.out;
}

TEST(Doctor, NamesWhatIsWrongOnTheBus) {
  const TestDomain domain;
  const Machine machine;
  const auto bus = test_participant(domain);
  RobotSender robot(bus, "robot1");
  dds::Writer<sensor_msgs::msg::CameraInfoPubSubType> wrong(
      bus, dds::topics::kCameraInfo, "rt/robot2/depth/image_raw", kTestDelivery);
  dds::TopicSpec statics = dds::topics::kTfStatic;
  dds::Writer<tf2_msgs::msg::TFMessagePubSubType> volatile_tf(bus, statics, statics.name,
                                                              kTestDelivery);
  Process doctor(machine.command(
      domain, {"--listen", "600", "--verbose", "--robot", "robot1", "--robot", "robot2", "--robot",
               "robot3", "--set", "node.segmentation=required"}));
  const CommandResult result =
      ask(doctor,
          [&](StampNs t) {
            robot.send_odometry({"map", "base", t, {}});
            robot.send_image(t);
          },
          {"rt/robot1/depth/image_raw: no_transform", "rt/robot1/odom: is announced",
           "rt/robot2/depth/image_raw: is announced", "rt/tf_static: is announced"});
  EXPECT_EQ(result.exit_code, 1);
  for (const char* line :
       {"error: rt/robot1/segmentation: nobody announces it",
        "error: rt/robot1/depth/image_raw: no_transform", "nobody says where \"robot1_camera\" is",
        "error: rt/robot2/depth/image_raw: has type sensor_msgs::msg::dds_::CameraInfo_",
        "error: rt/robot3/depth/image_raw: nobody announces it",
        "error: rt/robot3/odom: nobody announces it, nor rt/tf",
        "error: rt/tf_static: is offered volatile"}) {
    EXPECT_NE(result.out.find(line), std::string::npos) << line << "\n" << result.out;
  }
}

// Names without rt/, and partitions: both look right to the one who sends.
TEST(Doctor, NamesTopicsThatAreBesideTheExpectedOnes) {
  const TestDomain domain;
  const Machine machine;
  const auto bus = test_participant(domain);
  using ImageWriter = dds::Writer<sensor_msgs::msg::ImagePubSubType>;
  ImageWriter bare(bus, dds::topics::kDepth, "robot1/depth/image_raw", kTestDelivery);
  ImageWriter other(bus, dds::topics::kDepth, "rt/robot1/front/depth/image_rect_raw",
                    kTestDelivery);
  ImageWriter masks(bus, dds::topics::kSegmentation, "rt/robot1/semantic/image", kTestDelivery);
  dds::Writer<nav_msgs::msg::OdometryPubSubType> poses(bus, dds::topics::kOdometry, "rt/poses",
                                                       kTestDelivery);
  using namespace eprosima::fastdds::dds;  // NOLINT: our own writers are in no partition
  const auto use = bus->topic("rt/robot3/depth/image_raw",
                              TypeSupport(new dds::GuardedType<sensor_msgs::msg::ImagePubSubType>));
  PublisherQos partition;
  partition.partition().push_back("cameras");
  Publisher* publisher = bus->get()->create_publisher(partition);
  DataWriter* apart = publisher->create_datawriter(use.get(), DATAWRITER_QOS_DEFAULT);
  ASSERT_NE(apart, nullptr);
  Process doctor(machine.command(domain, {"--listen", "600", "--verbose", "--robot", "robot1",
                                          "--robot", "robot2", "--robot", "robot3"}));
  const CommandResult result = ask(
      doctor, [](StampNs) {},
      {"robot1/depth/image_raw: is announced", "rt/robot1/front/depth/image_rect_raw: is announced",
       "rt/robot3/depth/image_raw: is announced", "rt/robot1/semantic/image: is announced",
       "rt/poses: is announced"});
  publisher->delete_datawriter(apart);
  bus->get()->delete_publisher(publisher);
  EXPECT_EQ(result.exit_code, 1);
  for (const char* part :
       {"there is robot1/depth/image_raw, without rt/",
        "is in the partition \"cameras\": not heard",
        "image topics are: robot1/depth/image_raw, rt/robot1/front/depth/image_rect_raw",
        "--set 'node.topics.depth=", "note: rt/robot1/segmentation: nobody announces it",
        "there is rt/robot1/semantic/image; try --set "
        "'node.topics.segmentation=rt/{robot}/semantic/image'",
        "there is rt/poses (nav_msgs/msg/Odometry); try --set 'node.topics.odometry=rt/poses'"}) {
    EXPECT_NE(result.out.find(part), std::string::npos) << part << "\n" << result.out;
  }
}

// Such as those of Cyclone DDS.
TEST(Doctor, ParticipantsWithoutANameAreThere) {
  const TestDomain domain;
  const Machine machine;
  const dds::Participant nameless({domain.number(), "", ""});
  CommandResult result;
  EXPECT_TRUE(eventually([&] {
    result = run_command(machine.command(domain, {"--listen", "1"}));
    return result.out.find("participants: one without a name") != std::string::npos;
  })) << result.out;
  EXPECT_EQ(result.out.find("nobody else is there"), std::string::npos) << result.out;
}

TEST(Doctor, SuggestsAConfigurationThatFits) {
  const TestDomain domain;
  const auto bus = test_participant(domain);
  dds::Writer<sensor_msgs::msg::CameraInfoPubSubType> info(
      bus, dds::topics::kCameraInfo, "rt/r1/cam/depth/camera_info", kTestDelivery);
  dds::Writer<sensor_msgs::msg::ImagePubSubType> depth(
      bus, dds::topics::kDepth, "rt/r1/cam/depth/image_rect_raw", kTestDelivery);
  // Discovery takes a moment: a longer look where the first one was too short.
  CommandResult result;
  EXPECT_TRUE(eventually([&] {
    result =
        run_command({bin("pocd_doctor"), "--suggest", "--listen", "1", "--domain", domain.text()});
    return result.exit_code == 0 && result.out.find("camera_info_topic") != std::string::npos;
  })) << result.out
      << result.err;
  const TemporaryFolder folder;
  write_file(folder.path() / "suggested.yaml", result.out);
  const CommandResult dump =
      run_command({bin("pocd_node"), "--dump", "--config", source("config/simulated.yaml"),
                   "--config", (folder.path() / "suggested.yaml").string()});
  EXPECT_EQ(dump.exit_code, 0) << dump.err;
  for (const char* part : {"rt/r1/cam/depth/image_rect_raw", "rt/r1/cam/depth/camera_info"}) {
    EXPECT_NE(dump.out.find(part), std::string::npos) << part << "\n" << dump.out;
  }
}

TEST(Doctor, NamesWhatIsWrongWithConfigurationAndMachine) {
  const TestDomain domain;
  const Machine machine("212992");
  for (const char* name : {"fastrtps_dead", "fastrtps_dead_el", "fastrtps_live", "fastrtps_live_el",
                           "fastrtps_port7411", "fastrtps_port7411_el"}) {
    write_file(machine.shm() / name, "x");
  }
  const int held = open((machine.shm() / "fastrtps_live_el").c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_EQ(flock(held, LOCK_EX), 0);
  const CommandResult result =
      run_command(machine.command(domain, {"--listen", "0.1", "--set", "node.queue_framez=3"}));
  close(held);
  EXPECT_EQ(result.exit_code, 1);
  for (const char* line :
       {"error: configuration: ", "queue_frames", "warning: net.core.rmem_max: 212992 bytes",
        "sysctl -w net.core.wmem_max=4194304", "1 segments (0 MiB)", "nobody else is there",
        "no robot announces depth images"}) {
    EXPECT_NE(result.out.find(line), std::string::npos) << line << "\n" << result.out;
  }
  EXPECT_EQ(run_command({bin("pocd_doctor"), "--nonsense"}).exit_code, 2);
}

}  // namespace
}  // namespace pocd

// What robots really record gives the same map, and the same words about it, offline and on the
// bus.
#include <gtest/gtest.h>

#include <set>

#include "bus_processes.hpp"
#include "recorded_run.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;
using namespace recording;  // NOLINT: recordings are what this file is about
using Folder = recording::TemporaryFolder;

constexpr StampNs kBegin = 1'700'000'000'000'000'000;
constexpr int kFrames = 20;

/// What a robot does differently.
struct Variant {
  std::string name;
  StampNs mask_offset = 0;  // of its stamps
  int mask_id = 7;
  bool info_stamped = true;
  double quaternion = 1.0;  // length
  std::string slash;        // before the names of frames
  std::string tf = "/tf", tf_static = "/tf_static";
  int frame_changes_at = kFrames;
  StampNs camera_clock = 0;  // offset of all stamps of the camera
  std::map<std::string, std::string> qos;
  std::vector<std::string> settings;
  int frames = kFrames;           // that are made
  std::set<std::string> reasons;  // that are named
};

const std::map<std::string, std::string> kLatchedByNumber{
    {"offered_qos_profiles", "- history: 3\n  depth: 1\n  reliability: 1\n  durability: 1\n"}};
const std::map<std::string, std::string> kLatchedByName{
    {"offered_qos_profiles",
     "- history: keep_last\n  depth: 1\n  reliability: reliable\n  durability: transient_local\n"}};

std::vector<Variant> variants() {
  std::vector<Variant> list;
  const auto add = [&](const std::string& name) -> Variant& {
    list.emplace_back();
    list.back().name = name;
    list.back().qos = kLatchedByNumber;
    return list.back();
  };
  add("plain");
  add("qos_by_name").qos = kLatchedByName;
  add("no_qos").qos = {};
  add("qos_that_says_nothing").qos = {
      {"offered_qos_profiles", "- durability: best_available\n  reliability: best_available\n"}};
  add("masks_3ms_off").mask_offset = 3'000'000;
  Variant& off = add("masks_40ms_off");
  off.mask_offset = 40'000'000;
  off.reasons = {"no_mask"};
  Variant& unknown = add("masks_of_no_class");
  unknown.mask_id = 99;
  unknown.reasons = {"unlisted_class"};
  add("info_without_stamp").info_stamped = false;
  add("long_quaternion").quaternion = 1.0016;
  add("slashes").slash = "/";
  Variant& own = add("tf_of_its_own");
  own.tf = "/robot1/tf";
  own.tf_static = "/robot1/tf_static";
  own.settings = {"--set", "node.topics.tf=rt/{robot}/tf", "--set",
                  "node.topics.tf_static=/{robot}/tf_static"};
  Variant& changes = add("frame_changes");
  changes.frame_changes_at = 10;
  changes.frames = 10;
  changes.reasons = {"frame_changed"};
  Variant& boot = add("camera_from_boot");
  boot.camera_clock = -kBegin + 9'000'000'000;
  boot.frames = 0;
  boot.reasons = {"no_pose"};
  Variant& slow = add("rate");
  slow.settings = {"--set", "node.max_frame_rate_hz=5"};
  slow.frames = 10;
  return list;
}

void write(const fs::path& file, const Variant& v) {
  McapWriter writer(file);
  std::map<std::string, std::uint16_t> channels;
  const auto add = [&](const std::string& topic, const std::string& type,
                       const std::map<std::string, std::string>& metadata = {}) {
    channels[topic] =
        writer.add_channel(writer.add_schema(type, "ros2msg", ""), topic, "cdr", metadata);
  };
  add("/robot1/depth/image_raw", "sensor_msgs/msg/Image");
  add("/robot1/segmentation", "sensor_msgs/msg/Image");
  add("/robot1/depth/camera_info", "sensor_msgs/msg/CameraInfo");
  add(v.tf, "tf2_msgs/msg/TFMessage");
  add(v.tf_static, "tf2_msgs/msg/TFMessage", v.qos);
  const auto put = [&](const std::string& topic, StampNs log_ns, const Bytes& payload) {
    writer.write({channels.at(topic), 0, static_cast<std::uint64_t>(log_ns), 0}, payload.data(),
                 payload.size());
  };
  PoseQuaternion T;
  T.rotation.coeffs() *= v.quaternion;
  put(v.tf_static, kBegin - 1000,
      tf_payload(kBegin, v.slash + "base", v.slash + "camera", PoseQuaternion{}));
  const CameraModel camera{32, 24, 20, 20, 15.5, 11.5};
  for (int i = 0; i < kFrames; ++i) {
    const StampNs t = kBegin + i * kPeriod, image_t = t + v.camera_clock;
    cv::Mat depth(24, 32, CV_16UC1, cv::Scalar(1500)), mask(24, 32, CV_8UC1, cv::Scalar(0));
    mask.colRange(8, 20).setTo(v.mask_id);
    const std::string frame = v.slash + (i < v.frame_changes_at ? "camera" : "elsewhere");
    put("/robot1/depth/camera_info", t,
        camera_info_payload(v.info_stamped ? image_t : 0, frame, camera));
    put("/robot1/segmentation", t + 10,
        image_payload(image_t + v.mask_offset, frame, "mono8", mask));
    put("/robot1/depth/image_raw", t + 20, image_payload(image_t, frame, "16UC1", depth));
    put(v.tf, t + 30, tf_payload(t, v.slash + "map", v.slash + "base", T));
  }
  writer.close();
}

std::string config() { return std::string(POCD_SOURCE_DIR) + "/config/simulated.yaml"; }

std::string hex_after(const std::string& text, const std::string& before) {
  const std::size_t at = text.find(before);
  if (at == std::string::npos) return "";
  const std::size_t begin = at + before.size();
  return text.substr(begin, text.find_first_not_of("0123456789abcdef", begin) - begin);
}

/// Whether it says "TOPIC: REASON: " with this reason.
bool names(const std::string& text, const std::string& reason) {
  return text.find(": " + reason + ": ") != std::string::npos;
}

/// The words behind the reason, up to the end of the line or the bus's remark.
std::string words(const std::string& text, const std::string& reason) {
  const std::size_t at = text.find(": " + reason + ": ");
  if (at == std::string::npos) return "";
  std::string line = text.substr(at, text.find('\n', at) - at);
  return line.substr(0, line.find(" (logged once"));
}

TEST(LiveAndOffline, TheSameFramesTheSameMapTheSameWords) {
  const std::set<std::string> all_reasons{"no_mask",        "unlisted_class", "frame_changed",
                                          "no_pose",        "no_transform",   "non_unit_quaternion",
                                          "no_usable_depth"};
  for (const Variant& variant : variants()) {
    SCOPED_TRACE(variant.name);
    const Folder folder;
    const fs::path file = folder / "run.mcap";
    write(file, variant);
    std::vector<std::string> map{command("pocd_map"),
                                 "--dataset",
                                 "mcap",
                                 "--input",
                                 file.string(),
                                 "--config",
                                 config(),
                                 "--output",
                                 (folder / "map").string()};
    map.insert(map.end(), variant.settings.begin(), variant.settings.end());
    const CommandResult mapped = run_command(map);
    EXPECT_EQ(mapped.exit_code, variant.frames > 0 ? 0 : 1) << mapped.err;
    if (variant.frames > 0) {
      EXPECT_EQ(mapped.out.find(std::to_string(variant.frames) + " frames"), 0u) << mapped.out;
    }

    Process mirror({command("pocd_mirror"), "--until-end", "--timeout", "300"});
    std::vector<std::string> run{command("pocd_node"), "--config", config(), "--robot", "robot1",
                                 "--lossless"};
    run.insert(run.end(), variant.settings.begin(), variant.settings.end());
    Process node(run);
    ASSERT_TRUE(says(node, "running on domain"));
    const CommandResult played =
        run_command({command("pocd_play"), file.string(), "--lossless", "--fast"});
    EXPECT_EQ(played.exit_code, 0) << played.err;
    EXPECT_EQ(played.err.find("damaged"), std::string::npos) << played.err;
    ASSERT_TRUE(says(mirror, "in step with publisher"));
    const CommandResult ended = stop(node);
    const CommandResult mirrored = mirror.wait();
    EXPECT_NE(ended.err.find("ended: " + std::to_string(variant.frames) + " frames"),
              std::string::npos)
        << ended.err;
    if (variant.frames > 0) {
      const std::string offline = hex_after(mapped.out, "map ");
      EXPECT_FALSE(offline.empty());
      EXPECT_EQ(hex_after(mirrored.out, "digest "), offline) << mirrored.out << mirrored.err;
    }
    for (const std::string& reason : all_reasons) {
      const bool expected = variant.reasons.count(reason) > 0;
      EXPECT_EQ(names(mapped.err, reason), expected) << reason << "\n" << mapped.err;
      EXPECT_EQ(names(ended.err, reason), expected) << reason << "\n" << ended.err;
      EXPECT_EQ(words(mapped.err, reason), words(ended.err, reason));
    }
  }
}

TEST(LiveAndOffline, OptionsSayWhatIsLatched) {
  const Folder folder;
  const fs::path file = folder / "run.mcap";
  Variant variant;
  variant.qos = {{"offered_qos_profiles", "- durability: volatile\n  reliability: reliable\n"}};
  write(file, variant);
  Process node({command("pocd_node"), "--config", config(), "--robot", "robot1", "--lossless"});
  ASSERT_TRUE(says(node, "running on domain"));
  const CommandResult played = run_command(
      {command("pocd_play"), file.string(), "--lossless", "--fast", "--latch", "/tf_static"});
  EXPECT_EQ(played.exit_code, 0) << played.err;
  EXPECT_NE(stop(node).err.find("ended: 20 frames"), std::string::npos);
  const CommandResult as_recorded =
      run_command({command("pocd_play"), file.string(), "--fast", "--no-wait"});
  EXPECT_NE(as_recorded.err.find("/tf_static: was recorded volatile: who asks for latched messages "
                                 "does not hear it (--latch /tf_static)"),
            std::string::npos)
      << as_recorded.err;
  const CommandResult typo = run_command({command("pocd_play"), file.string(), "--latch", "/tff"});
  EXPECT_NE(typo.exit_code, 0);
  EXPECT_NE(typo.err.find("--latch /tff: matches no topic"), std::string::npos) << typo.err;
}

TEST(LiveAndOffline, MessagesThatAreNotPlayedAreNamed) {
  const Folder folder;
  const fs::path file = folder / "run.mcap";
  {
    McapWriter writer(file);
    const auto schema = writer.add_schema("sensor_msgs/Image", "ros1msg", "");
    writer.add_channel(schema, "/camera/image", "ros1", {});
    writer.close();
  }
  const CommandResult played = run_command({command("pocd_play"), file.string(), "--no-wait"});
  EXPECT_EQ(played.exit_code, 1);
  EXPECT_NE(played.err.find("/camera/image: is not played: its messages are in \"ros1\", only cdr "
                            "is played; a recording of ROS 1 has to be converted"),
            std::string::npos)
      << played.err;
}

}  // namespace
}  // namespace pocd

// What was recorded comes back as it was: payloads, quality of service, disposes, and the map.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "bus_processes.hpp"
#include "pocd/recording/cdr.hpp"
#include "pocd/recording/recording_reader.hpp"
#include "recordings.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;
using recording::Bytes;
using recording::Kept;
using recording::MessageHeader;
using Folder = recording::TemporaryFolder;

using ByTopic = std::map<std::string, std::vector<Bytes>>;

ByTopic payloads(recording::RecordingReader& reader) {
  ByTopic out;
  for (Kept& kept : recording::read_all(reader)) out[kept.topic].push_back(std::move(kept.data));
  return out;
}

ByTopic payloads(const fs::path& file) { return payloads(*recording::open_recording(file)); }

std::string config() { return std::string(POCD_SOURCE_DIR) + "/config/simulated.yaml"; }
std::string scenario() {
  return std::string(POCD_SOURCE_DIR) + "/test/integration/recording/small_run.yaml";
}

void play_simulation(const std::vector<std::string>& more) {
  std::vector<std::string> play{command("pocd_play"), "--dataset", "sim",        "--input",
                                scenario(),           "--fast",    "--lossless", "--no-color"};
  play.insert(play.end(), more.begin(), more.end());
  const CommandResult played = run_command(play);
  ASSERT_EQ(played.exit_code, 0) << played.err;
}

/// The simulated run as the bus carries it.
void record_simulation(const fs::path& file, const std::vector<std::string>& more = {}) {
  Process recorder({command("pocd_record"), "--output", file.string()});
  ASSERT_TRUE(says(recorder, "recording on domain"));
  play_simulation(more);
  const CommandResult recorded = stop(recorder);
  EXPECT_NE(recorded.out.find(" 0 dropped, 0 lost"), std::string::npos) << recorded.out;
}

std::string digest_in(const std::string& text, const std::string& before) {
  const std::size_t at = text.find(before);
  if (at == std::string::npos) return "none in: " + text;
  const std::size_t begin = at + before.size();
  return text.substr(begin, text.find_first_not_of("0123456789abcdef", begin) - begin);
}

std::string offline_digest(const fs::path& recording, const std::string& threads,
                           const std::vector<std::string>& more = {}) {
  const Folder folder;
  std::vector<std::string> map{command("pocd_map"),
                               "--dataset",
                               "mcap",
                               "--input",
                               recording.string(),
                               "--config",
                               config(),
                               "--threads",
                               threads,
                               "--output",
                               folder.path().string()};
  map.insert(map.end(), more.begin(), more.end());
  const CommandResult mapped = run_command(map);
  EXPECT_EQ(mapped.exit_code, 0) << mapped.err;
  EXPECT_EQ(mapped.err, "");
  return digest_in(mapped.out, "map ");
}

/// Plays a recording to the node and gives the digest of the mirror's copy.
std::string replayed_digest(const fs::path& recording, const std::vector<std::string>& speed,
                            const std::string& threads) {
  Process mirror({command("pocd_mirror"), "--until-end", "--timeout", "300"});
  Process node({command("pocd_node"), "--config", config(), "--robot", "robot1", "--robot",
                "robot2", "--lossless", "--set", "threads=" + threads});
  if (!says(node, "running on domain")) return "";
  std::vector<std::string> play{command("pocd_play"),
                                recording.string(),
                                "--lossless",
                                "--topics",
                                "/robot*",
                                "--topics",
                                "/tf*"};
  play.insert(play.end(), speed.begin(), speed.end());
  const CommandResult played = run_command(play);
  EXPECT_EQ(played.exit_code, 0) << played.err;
  // A run this short could be over before the mirror has heard of the node.
  EXPECT_TRUE(says(mirror, "in step with publisher"));
  stop(node);
  const CommandResult mirrored = mirror.wait();
  EXPECT_EQ(mirrored.exit_code, 0) << mirrored.err;
  return digest_in(mirrored.out, "digest ");
}

TEST(RecordReplay, KeepsEveryPayloadOfAReplay) {
  const Folder folder;
  record_simulation(folder / "first.mcap", {"--max-frames", "20"});
  Process recorder({command("pocd_record"), "--output", (folder / "second.mcap").string(),
                    "--compression", "lz4"});
  ASSERT_TRUE(says(recorder, "recording on domain"));
  // The recorder finds topic after topic: what is sent before it reads one, it does not hear.
  const CommandResult played = run_command({command("pocd_play"), (folder / "first.mcap").string(),
                                            "--fast", "--lossless", "--wait-for", "*"});
  ASSERT_EQ(played.exit_code, 0) << played.err;
  const CommandResult recorded = stop(recorder);
  EXPECT_NE(recorded.out.find(" 0 dropped, 0 lost"), std::string::npos) << recorded.out;
  const ByTopic first = payloads(folder / "first.mcap");
  EXPECT_EQ(first.count("/robot1/depth/image_raw"), 1u);
  EXPECT_EQ(first.count("/tf_static"), 1u);
  ByTopic second = payloads(folder / "second.mcap");
  for (const auto& [topic, all] : first) EXPECT_TRUE(second[topic] == all) << topic;
  EXPECT_EQ(second.size(), first.size());
}

TEST(RecordReplay, EveryFileOfASplitHasTheLatchedSamples) {
  const Folder folder;
  const std::vector<std::string> record{command("pocd_record"), "--output",
                                        (folder / "run.mcap").string(), "--split-size", "0.1"};
  Process recorder(record);
  ASSERT_TRUE(says(recorder, "recording on domain"));
  const CommandResult played =
      run_command({command("pocd_play"), "--dataset", "sim", "--input", scenario(), "--fast",
                   "--lossless", "--no-color", "--max-frames", "20"});
  ASSERT_EQ(played.exit_code, 0) << played.err;
  stop(recorder);
  const ByTopic first = payloads(folder / "run_0000.mcap"),
                second = payloads(folder / "run_0001.mcap");
  ASSERT_GT(second.count("/robot1/depth/image_raw"), 0u);
  ASSERT_GT(first.count("/tf_static"), 0u);
  EXPECT_TRUE(second.count("/tf_static") > 0 && second.at("/tf_static") == first.at("/tf_static"));

  const CommandResult again = run_command(record);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("run_0000.mcap exists already; --overwrite"), std::string::npos)
      << again.err;
  EXPECT_TRUE(payloads(folder / "run_0000.mcap") == first);
  std::vector<std::string> replace = record;
  replace.push_back("--overwrite");
  Process third(replace);
  EXPECT_TRUE(says(third, "recording on domain"));
  stop(third);
  EXPECT_EQ(payloads(folder / "run_0000.mcap").count("/tf_static"), 0u) << "nobody sent";
  EXPECT_FALSE(fs::exists(folder / "run_0001.mcap")) << "of the recording that was replaced";
}

// A recorder that runs for months would keep, and write into each file, what all robots ever said.
TEST(RecordReplay, AFileHasNothingLatchedOfWritersThatHadGone) {
  const Folder folder;
  const std::vector<std::string> visit{"--max-frames", "20"};
  record_simulation(folder / "one_visit.mcap", visit);
  const std::size_t of_one = payloads(folder / "one_visit.mcap").at("/tf_static").size();
  fs::create_directory(folder / "split");
  Process recorder({command("pocd_record"), "--output", (folder / "split" / "run.mcap").string(),
                    "--split-size", "0.1"});
  ASSERT_TRUE(says(recorder, "recording on domain"));
  for (int i = 0; i < 3; ++i) play_simulation(visit);
  stop(recorder);
  fs::path last;
  for (const auto& entry : fs::directory_iterator(folder / "split")) {
    if (entry.path().extension() == ".mcap") last = std::max(last, entry.path());
  }
  EXPECT_LE(payloads(last).at("/tf_static").size(), of_one) << last;
}

/// Topics of a type that nothing here was built with.
void write_foreign(const fs::path& file) {
  recording::McapWriter writer(file);
  const auto schema = writer.add_schema("foreign::Thing", "", "");
  const auto qos = [](const std::string& reliable, const std::string& latched,
                      const std::string& keyed) {
    return "reliability: " + reliable + "\ndurability: " + latched +
           "\nownership: false\nkeyed: " + keyed;
  };
  const auto plain = writer.add_channel(
      schema, "plain", "cdr",
      {{"qos", qos("true", "false", "false")}, {"ros2-types", "false"}, {"partitions", "a|b"}});
  const auto best_effort = writer.add_channel(
      schema, "best_effort", "cdr",
      {{"qos", qos("false", "false", "false")}, {"ros2-types", "false"}, {"partitions", ""}});
  const auto keyed_schema = writer.add_schema("foreign::Keyed", "", "");
  const auto keyed = writer.add_channel(
      keyed_schema, "keyed", "cdr",
      {{"qos", qos("true", "true", "true")}, {"ros2-types", "false"}, {"partitions", ""}});
  const auto instances =
      writer.add_channel(0, "keyed/_instances", "cdr", {{"instances_of", "keyed"}});
  std::uint64_t time_ns = 1'000'000'000;
  const auto write = [&](std::uint16_t channel, const Bytes& bytes) {
    writer.write({channel, 0, time_ns, time_ns}, bytes.data(), bytes.size());
  };
  const auto instance = [&](std::uint8_t change, std::uint8_t id) {
    Bytes bytes{0, 1, 0, 0, change};
    bytes.resize(4 + 1 + 16);
    bytes[20] = id;
    write(instances, bytes);
  };
  for (std::uint8_t i = 0; i < 10; ++i) {
    time_ns += 20'000'000;
    // Whole words: the bus fills the last one up.
    const Bytes bytes{0, 1, 0, 0, i, 2, 3, 4};
    write(plain, bytes);
    write(best_effort, bytes);
    instance(0, static_cast<std::uint8_t>(1 + i % 3));
    write(keyed, bytes);
  }
  time_ns += 20'000'000;
  instance(1, 2);  // disposed
  instance(2, 3);  // unregistered
  writer.close();
}

TEST(RecordReplay, APatternThatMatchesNothingIsNamed) {
  const Folder folder;
  write_foreign(folder / "run.mcap");
  const CommandResult result =
      run_command({command("pocd_play"), (folder / "run.mcap").string(), "--topics", "/dpeth"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.err.find("--topics /dpeth: matches none of best_effort, keyed, plain"),
            std::string::npos)
      << result.err;
}

TEST(RecordReplay, UnknownTypesPartitionsAndDisposesComeBack) {
  const Folder folder;
  write_foreign(folder / "first.mcap");
  Process recorder({command("pocd_record"), "--output", (folder / "second.mcap").string()});
  ASSERT_TRUE(says(recorder, "recording on domain"));
  const CommandResult played = run_command(
      {command("pocd_play"), (folder / "first.mcap").string(), "--rate", "2", "--wait-for", "*"});
  ASSERT_EQ(played.exit_code, 0) << played.err;
  EXPECT_NE(played.out.find("30 messages and 2 instance changes sent"), std::string::npos)
      << played.out;
  stop(recorder);

  ByTopic first = payloads(folder / "first.mcap");
  const auto reader = recording::open_recording(folder / "second.mcap");
  ByTopic second = payloads(*reader);
  // Best effort promises nothing, except the order.
  EXPECT_LE(second["best_effort"].size(), 10u);
  first.erase("best_effort");
  second.erase("best_effort");
  // When the player goes, the bus says that its instances have no writer any more.
  std::vector<Bytes>& changes = second["keyed/_instances"];
  ASSERT_GE(changes.size(), first["keyed/_instances"].size());
  changes.resize(first["keyed/_instances"].size());
  for (const auto& [topic, list] : first) {
    EXPECT_TRUE(list == second[topic])
        << topic << ": " << list.size() << " became " << second[topic].size();
  }
  std::map<std::string, const recording::RecordedChannel*> channels;
  for (const auto& channel : reader->channels()) channels[channel.topic] = &channel;
  EXPECT_EQ(channels.at("plain")->metadata.at("partitions"), "a|b");
  EXPECT_EQ(channels.at("plain")->type, "foreign::Thing");
  EXPECT_NE(channels.at("best_effort")->metadata.at("qos").find("reliability: false"),
            std::string::npos);
  EXPECT_NE(channels.at("keyed")->metadata.at("qos").find("durability: true"), std::string::npos);
  EXPECT_NE(channels.at("keyed")->metadata.at("qos").find("keyed: true"), std::string::npos);
}

// ROS 2's own bookkeeping and services: played again, they would make nodes that are not there.
TEST(RecordReplay, TheGraphOfRos2IsLeftOutUnlessItIsNamed) {
  const Folder folder;
  {
    recording::McapWriter writer(folder / "first.mcap");
    const auto schema = writer.add_schema("foreign::Thing", "", "");
    for (const char* topic : {"ros_discovery_info", "rq/askRequest", "rr/askReply", "plain"}) {
      const auto channel = writer.add_channel(
          schema, topic, "cdr",
          {{"qos", "reliability: true\ndurability: true\nownership: false\nkeyed: false"},
           {"ros2-types", "false"},
           {"partitions", ""}});
      const Bytes bytes{0, 1, 0, 0, 1, 2, 3, 4};
      // Ten seconds, in which everybody hears of them.
      for (const std::uint64_t time_ns : {1'000'000'000ull, 11'000'000'000ull}) {
        writer.write({channel, 0, time_ns, time_ns}, bytes.data(), bytes.size());
      }
    }
    writer.close();
  }
  // The other one got them, so the bus had them when this one left them out.
  Process usual({command("pocd_record"), "--output", (folder / "usual.mcap").string()});
  Process asked({command("pocd_record"), "--output", (folder / "asked.mcap").string(), "--topic",
                 "ros_discovery_info", "--topic", "r?/*", "--topic", "plain"});
  ASSERT_TRUE(says(usual, "recording on domain") && says(asked, "recording on domain"));
  const std::vector<std::string> play{command("pocd_play"),
                                      (folder / "first.mcap").string(),
                                      "--fast",
                                      "--lossless",
                                      "--wait-for",
                                      "plain"};
  const CommandResult played = run_command(play);
  EXPECT_NE(played.out.find("2 messages"), std::string::npos) << played.out << played.err;
  Process player({command("pocd_play"), (folder / "first.mcap").string(), "--lossless",
                  "--wait-for", "ros_discovery_info", "--wait-for", "r?/*", "--topics", "*"});
  for (const char* topic : {"ros_discovery_info", "rq/askRequest", "rr/askReply"}) {
    EXPECT_TRUE(says(usual, std::string(topic) + ": is left out (--topic records it)"));
  }
  const CommandResult played_all = player.wait();
  EXPECT_NE(played_all.out.find("8 messages"), std::string::npos)
      << played_all.out << played_all.err;
  stop(usual), stop(asked);
  const ByTopic usual_topics = payloads(folder / "usual.mcap");
  ByTopic asked_topics = payloads(folder / "asked.mcap");
  EXPECT_EQ(usual_topics.size(), 1u);
  EXPECT_EQ(usual_topics.count("plain"), 1u);
  for (const char* topic : {"ros_discovery_info", "rq/askRequest", "rr/askReply", "plain"}) {
    EXPECT_GE(asked_topics[topic].size(), 1u) << topic;
  }
}

TEST(RecordReplay, AKilledRecorderLeavesAReadableFile) {
  const Folder folder;
  Process recorder({command("pocd_record"), "--output", (folder / "killed.mcap").string()});
  ASSERT_TRUE(says(recorder, "recording on domain"));
  Process player({command("pocd_play"), "--dataset", "sim", "--input", scenario(), "--no-color"});
  // One chunk is there as soon as the first second is over.
  for (int i = 0; i < 1200 && fs::file_size(folder / "killed.mcap") < 10'000; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  recorder.signal(SIGKILL);
  EXPECT_EQ(recorder.wait().exit_code, 128 + SIGKILL);
  player.signal(SIGTERM);
  player.wait();
  const CommandResult info =
      run_command({command("pocd_info"), "--verify", (folder / "killed.mcap").string()});
  EXPECT_EQ(info.exit_code, 1);
  EXPECT_NE(info.err.find("no footer at the end"), std::string::npos) << info.err;
  EXPECT_NE(info.out.find("/robot1/depth/image_raw"), std::string::npos) << info.out;
  EXPECT_GT(payloads(folder / "killed.mcap")["/robot1/depth/image_raw"].size(), 0u);
}

TEST(SameMap, OfflineAndReplaysAtAnySpeed) {
  const Folder folder;
  record_simulation(folder / "run.mcap");
  const std::string expected = offline_digest(folder / "run.mcap", "1");
  ASSERT_EQ(expected.size(), 32u) << expected;
  EXPECT_EQ(offline_digest(folder / "run.mcap", "2"), expected);
  EXPECT_EQ(replayed_digest(folder / "run.mcap", {"--rate", "1"}, "1"), expected);
  EXPECT_EQ(replayed_digest(folder / "run.mcap", {"--rate", "10"}, "2"), expected);
  EXPECT_EQ(replayed_digest(folder / "run.mcap", {"--fast"}, "1"), expected);
  EXPECT_EQ(replayed_digest(folder / "run.mcap", {"--fast"}, "2"), expected);
}

TEST(SameMap, AtATenthOfTheSpeed) {
  const Folder folder;
  record_simulation(folder / "run.mcap", {"--max-frames", "8"});
  const std::string expected = offline_digest(folder / "run.mcap", "1");
  ASSERT_EQ(expected.size(), 32u) << expected;
  EXPECT_EQ(replayed_digest(folder / "run.mcap", {"--rate", "0.1"}, "1"), expected);
}

TEST(SameMap, ALiveRunWithDroppedFramesFromItsRecording) {
  const Folder folder;
  record_simulation(folder / "run.mcap", {"--max-frames", "60"});
  const fs::path file = folder / "live.mcap";
  // Small voxels: too slow for every frame.
  const std::string voxels = "map.voxel_size_m=0.015";
  Process recorder({command("pocd_record"), "--output", file.string()});
  ASSERT_TRUE(says(recorder, "recording on domain"));
  Process mirror({command("pocd_mirror"), "--until-end", "--timeout", "300"});
  Process node({command("pocd_node"), "--config", config(), "--robot", "robot1", "--robot",
                "robot2", "--set", "node.queue_frames=1", "--set", voxels});
  ASSERT_TRUE(says(recorder, "recording pocd/frames"));
  // The player waits for the recorder, which is reliable, but not for the node, which is not.
  std::vector<std::string> play{command("pocd_play"),
                                (folder / "run.mcap").string(),
                                "--fast",
                                "--lossless",
                                "--topics",
                                "/robot*",
                                "--topics",
                                "/tf*",
                                "--readers",
                                "2"};
  for (const char* topic : {"depth/image_raw", "depth/camera_info", "segmentation", "odom"}) {
    play.insert(play.end(), {"--wait-for", std::string("/robot*/") + topic});
  }
  const CommandResult played = run_command(play);
  ASSERT_EQ(played.exit_code, 0) << played.err;
  ASSERT_TRUE(says(mirror, "in step with publisher"));
  const CommandResult ended = stop(node);
  const CommandResult mirrored = mirror.wait();
  EXPECT_EQ(mirrored.exit_code, 0) << mirrored.err;
  stop(recorder);
  const std::string live = digest_in(mirrored.out, "digest ");
  EXPECT_EQ(offline_digest(file, "1", {"--as-live", "--set", voxels}), live);
  // How many were dropped depends on the machine; with all of them the map is another one.
  if (ended.err.find("ended: 60 frames processed") == std::string::npos) {
    EXPECT_NE(offline_digest(file, "1", {"--set", voxels}), live);
  }
}

}  // namespace
}  // namespace pocd

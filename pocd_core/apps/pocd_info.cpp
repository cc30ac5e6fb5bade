// What a recording holds, and what is damaged.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <iostream>

#include "pocd/common/check.hpp"
#include "pocd/input/suggest_input.hpp"
#include "pocd/recording/recording_files.hpp"

namespace {

using namespace pocd::recording;  // NOLINT: this program is about nothing else

/// Seconds since 1970 with nanoseconds, and as a date.
std::string time_text(std::uint64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / 1'000'000'000);
  std::tm parts{};
  char date[32] = "", text[80];
  if (gmtime_r(&seconds, &parts) != nullptr) {
    std::strftime(date, sizeof date, "%Y-%m-%d %H:%M:%S", &parts);
  }
  std::snprintf(text, sizeof text, "%lld.%09llu (%s UTC)", static_cast<long long>(seconds),
                static_cast<unsigned long long>(ns % 1'000'000'000), date);
  return text;
}

/// Text of a file cannot steer the terminal.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, '?');
  return text;
}

void print(const std::filesystem::path& file, const RecordingReader& reader) {
  const RecordingInfo& info = reader.info();
  const double seconds =
      info.end_ns >= info.start_ns ? static_cast<double>(info.end_ns - info.start_ns) * 1e-9 : 0.0;
  std::cout << "file:      " << file.string() << "\nformat:    " << info.format;
  if (!info.library.empty()) std::cout << ", written by " << printable(info.library);
  if (info.recovered) std::cout << ", without usable index";
  std::cout << "\nsize:      " << info.bytes << " bytes";
  if (info.format == "mcap") {
    std::cout << ", " << info.chunks << " chunks (";
    bool first = true;
    for (const auto& [compression, count] : info.chunks_by_compression) {
      std::cout << (first ? "" : ", ") << count << " "
                << (compression.empty() ? "not compressed" : printable(compression));
      first = false;
    }
    std::cout << ")";
  }
  std::cout << "\nmessages:  " << info.messages << "\n";
  if (info.messages > 0) {
    char duration[64];
    std::snprintf(duration, sizeof duration, "%.3f", seconds);
    std::cout << "duration:  " << duration << " s\n";
    std::cout << "start:     " << time_text(info.start_ns)
              << "\nend:       " << time_text(info.end_ns) << "\n";
  }
  std::vector<const RecordedChannel*> channels;
  for (const RecordedChannel& channel : reader.channels()) channels.push_back(&channel);
  std::stable_sort(channels.begin(), channels.end(),
                   [](const auto* a, const auto* b) { return a->topic < b->topic; });
  std::cout << "topics:    " << channels.size() << "\n";
  for (const RecordedChannel* channel : channels) {
    std::cout << "  " << printable(channel->topic) << "  " << printable(channel->type) << "  "
              << channel->messages << " messages  " << printable(channel->message_encoding);
    if (!channel->schema_encoding.empty()) std::cout << ", " << printable(channel->schema_encoding);
    const auto partitions = channel->metadata.find("partitions");
    if (partitions != channel->metadata.end() && !partitions->second.empty()) {
      std::cout << ", partitions " << printable(partitions->second);
    }
    std::cout << "\n";
  }
}

/// A configuration for the cameras in these recordings, on stdout. False: none is in them.
bool suggest(const std::vector<std::filesystem::path>& inputs) {
  std::vector<pocd::TopicInfo> topics;
  for (const auto& input : inputs) {
    for (const auto& file : recording_files(input)) {
      const auto reader = open_recording(file);
      for (const RecordedChannel& channel : reader->channels()) {
        if (channel.messages == 0) continue;
        topics.push_back({pocd::bus_name(channel.topic), pocd::ros_type_name(channel.type)});
      }
    }
  }
  const std::vector<pocd::RobotConfig> robots = pocd::suggest_robots(topics);
  std::cout << pocd::suggestion_yaml(robots);
  if (robots.empty()) {
    std::cerr << "pocd_info: no depth images: " << printable(pocd::suggestion_text(topics)) << '\n';
  }
  return !robots.empty();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Says what recordings hold (MCAP, or rosbag2's .db3), and what in them is damaged.\n"
      "Example: pocd_info --verify run.mcap\n"
      "Exit code: 0 whole, 1 damaged or unreadable, 2 usage.",
      "pocd_info");
  std::vector<std::filesystem::path> inputs;
  bool verify = false, suggested = false;
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("FILE", inputs, "Files, or folders of them")->required();
  app.add_flag("--verify", verify, "Read every chunk and check its CRC");
  app.add_flag("--suggest", suggested,
               "Only print a configuration for the cameras in them (--config of pocd_map and "
               "pocd_node)");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  bool whole = true;
  try {
    if (suggested) return suggest(inputs) && std::cout.flush() ? 0 : 1;
    for (const auto& input : inputs) {
      for (const auto& file : recording_files(input)) {
        const auto reader = open_recording(file);
        if (verify) {
          RecordedMessage message;
          while (reader->next(message)) {
          }
        }
        print(file, *reader);
        std::cout.flush();
        for (const std::string& problem : reader->problems()) {
          std::cerr << "pocd_info: " << printable(problem) << '\n';
        }
        if (reader->problem_count() > reader->problems().size()) {
          std::cerr << "pocd_info: " << file.string() << ": "
                    << reader->problem_count() - reader->problems().size() << " more problems\n";
        }
        whole = whole && reader->problem_count() == 0;
      }
    }
  } catch (const std::exception& error) {
    std::cerr << "pocd_info: " << error.what() << '\n';
    return 1;
  }
  return std::cout.flush() && whole ? 0 : 1;
}

#include "bag_metadata.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

namespace pocd::recording {
namespace {

/// A double-quoted scalar of YAML.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n') {
      out += "\\n";
    } else if (static_cast<unsigned char>(c) >= 32) {
      out += c;
    }
  }
  return out + "\"";
}

void put_span(std::ostream& out, const std::string& indent, std::uint64_t start_ns,
              std::uint64_t end_ns) {
  out << indent << "duration:\n"
      << indent << "  nanoseconds: " << end_ns - start_ns << "\n"
      << indent << "starting_time:\n"
      << indent << "  nanoseconds_since_epoch: " << start_ns << "\n";
}

}  // namespace

std::string bag_metadata_yaml(const BagMetadata& metadata) {
  std::uint64_t start_ns = 0, end_ns = 0, messages = 0;
  for (const BagFile& file : metadata.files) {
    if (file.messages == 0) continue;
    start_ns = messages == 0 ? file.start_ns : std::min(start_ns, file.start_ns);
    end_ns = std::max(end_ns, file.end_ns);
    messages += file.messages;
  }
  std::ostringstream topics;
  for (const ChannelRecord& channel : metadata.channels) {
    if (channel.topic.empty() || channel.topic[0] != '/') continue;
    const auto count = metadata.messages.find(channel.id);
    const auto qos = channel.metadata.find("offered_qos_profiles");
    std::string type;
    for (const SchemaRecord& schema : metadata.schemas) {
      if (schema.id == channel.schema_id) type = schema.name;
    }
    topics << "    - topic_metadata:\n        name: " << quoted(channel.topic)
           << "\n        type: " << quoted(type)
           << "\n        serialization_format: " << channel.message_encoding
           << "\n        offered_qos_profiles: "
           << quoted(qos == channel.metadata.end() ? "" : qos->second)
           << "\n      message_count: " << (count == metadata.messages.end() ? 0 : count->second)
           << "\n";
  }
  std::ostringstream out;
  out << "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n";
  put_span(out, "  ", start_ns, end_ns);
  out << "  message_count: " << messages
      << "\n  topics_with_message_count:" << (topics.str().empty() ? " []" : "") << "\n"
      << topics.str() << "  compression_format: \"\"\n  compression_mode: \"\"\n"
      << "  relative_file_paths:\n";
  for (const BagFile& file : metadata.files) {
    out << "    - " << quoted(file.path.filename().string()) << "\n";
  }
  out << "  files:\n";
  for (const BagFile& file : metadata.files) {
    out << "    - path: " << quoted(file.path.filename().string()) << "\n";
    put_span(out, "      ", file.start_ns, file.end_ns);
    out << "      message_count: " << file.messages << "\n";
  }
  return out.str();
}

bool write_bag_metadata(const std::filesystem::path& folder, const BagMetadata& metadata) {
  const std::filesystem::path file =
      (folder.empty() ? std::filesystem::path(".") : folder) / "metadata.yaml";
  std::ifstream before(file);
  if (before && !metadata.files.empty()) {
    const std::string text((std::istreambuf_iterator<char>(before)), {});
    const std::string ours = metadata.files.front().path.filename().string();
    if (text.find("- " + quoted(ours) + "\n") == std::string::npos) return false;
  }
  std::ofstream(file) << bag_metadata_yaml(metadata);
  return true;
}

}  // namespace pocd::recording

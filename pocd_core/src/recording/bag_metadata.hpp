// rosbag2's list of a folder's files, so that it opens a split recording as one.
#pragma once

#include <filesystem>
#include <map>
#include <vector>

#include "pocd/recording/mcap_records.hpp"

namespace pocd::recording {

struct BagFile {
  std::filesystem::path path;
  std::uint64_t start_ns = 0, end_ns = 0;  ///< log times; both 0 without messages
  std::uint64_t messages = 0;
};

/// What the metadata of a recording says (rosbag2's version 5, which Humble and later read).
struct BagMetadata {
  std::vector<SchemaRecord> schemas;
  std::vector<ChannelRecord> channels;
  std::map<std::uint16_t, std::uint64_t> messages;  ///< by channel
  std::vector<BagFile> files;
};

/// As YAML. Channels that are no topics of ROS ("/...") are left out.
std::string bag_metadata_yaml(const BagMetadata& metadata);

/// Writes `folder`/metadata.yaml, unless there is one of other files. False: there is.
bool write_bag_metadata(const std::filesystem::path& folder, const BagMetadata& metadata);

}  // namespace pocd::recording

// Reads rosbag2's SQLite files.
#pragma once

#include "pocd/recording/recording_reader.hpp"

namespace pocd::recording {

/// Throws InputError when the tables of rosbag2 are not there. A page that cannot be read ends the
/// messages, with a problem.
/// `name` begins every problem.
std::unique_ptr<RecordingReader> open_db3(const std::filesystem::path& file,
                                          const std::string& name, const ReaderLimits& limits);

}  // namespace pocd::recording

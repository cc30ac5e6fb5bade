// Topics of a recording against what frames are made of: what fits, and what is not there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pocd/input/robot_streams.hpp"
#include "pocd/input/suggest_input.hpp"
#include "pocd/recording/recording_reader.hpp"

namespace pocd {

TimeSynchronizer::Stream stream_of(InputStream stream);

/// Whether the type of the messages is that of the stream, images perhaps compressed.
bool fits(const recording::RecordedChannel& channel, InputStream stream);
/// Why messages of a topic that is named for the stream cannot feed it, if so.
std::optional<InputProblem> misfit(const recording::RecordedChannel& channel, InputStream stream);

/// A topic of a recording, by its bus name.
struct SeenTopic {
  TopicInfo info;
  bool has_messages;
};
std::vector<TopicInfo> recorded_topics(const std::vector<SeenTopic>& seen);

/// One line each: the topic that is empty, which topics of its kind are not, and what to write into
/// the command line. Camera info and poses, when frames were dropped for them; masks, when they are
/// required or seem to be on another topic.
std::vector<std::string> absent_streams(const RobotStreams& robot, const InputConfig& input,
                                        const std::vector<SeenTopic>& seen);

}  // namespace pocd

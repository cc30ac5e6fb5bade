#include "recorded_topics.hpp"

#include <algorithm>

namespace pocd {

TimeSynchronizer::Stream stream_of(InputStream stream) {
  using Stream = TimeSynchronizer::Stream;
  switch (stream) {
    case InputStream::kDepth:
      return Stream::kDepth;
    case InputStream::kSegmentation:
      return Stream::kSegmentation;
    case InputStream::kColor:
      return Stream::kColor;
    case InputStream::kCameraInfo:
      return Stream::kCameraInfo;
    default:
      return Stream::kPose;
  }
}

bool fits(const recording::RecordedChannel& channel, InputStream stream) {
  const std::string type = ros_type_name(channel.type);
  return type == ros_type(stream) || (is_image(stream) && type == ros_type(stream, true));
}

std::optional<InputProblem> misfit(const recording::RecordedChannel& channel, InputStream stream) {
  if (!fits(channel, stream)) {
    return InputProblem{InputReason::kWrongType,
                        "has type " + channel.type + ", expected " + ros_type(stream)};
  }
  const std::string& encoding = channel.message_encoding;
  if (encoding == "cdr") return std::nullopt;
  return InputProblem{
      InputReason::kWrongType,
      "has messages in \"" + encoding + "\", expected \"cdr\"" +
          (encoding == "ros1" ? ": a recording of ROS 1 has to be converted (rosbags-convert)"
                              : "")};
}

std::vector<TopicInfo> recorded_topics(const std::vector<SeenTopic>& seen) {
  std::vector<TopicInfo> topics;
  for (const SeenTopic& topic : seen) topics.push_back(topic.info);
  return topics;
}

std::vector<std::string> absent_streams(const RobotStreams& robot, const InputConfig& input,
                                        const std::vector<SeenTopic>& seen) {
  std::vector<std::string> lines;
  std::vector<TopicInfo> others;
  for (const SeenTopic& topic : seen) {
    if (topic.has_messages) others.push_back(topic.info);
  }
  const auto empty = [&](InputStream stream) {
    const std::string topic = robot.topic(stream);
    return std::none_of(others.begin(), others.end(),
                        [&](const TopicInfo& info) { return info.topic == topic; });
  };
  const auto tell = [&](InputStream stream, const std::string& topics, bool always) {
    const std::string instead = instead_of(stream, robot.config(), input, others);
    if (instead.empty() && !always) return;
    lines.push_back(topics + ": the recording has no message on it" +
                    (instead.empty() ? "" : "; " + instead));
  };
  const SynchronizerCounts& counts = robot.synchronizer().counts();
  if (counts.dropped_no_camera_info > 0 && empty(InputStream::kCameraInfo)) {
    tell(InputStream::kCameraInfo, robot.topic(InputStream::kCameraInfo), true);
  }
  if (counts.dropped_no_pose > 0 && empty(InputStream::kOdometry) && empty(InputStream::kTf)) {
    tell(InputStream::kOdometry,
         robot.topic(InputStream::kOdometry) + " and " + robot.topic(InputStream::kTf), true);
  }
  const bool wants_masks = counts.complete > 0 && input.segmentation == StreamUse::kOptional;
  if ((wants_masks || counts.dropped_no_segmentation > 0) && empty(InputStream::kSegmentation)) {
    tell(InputStream::kSegmentation, robot.topic(InputStream::kSegmentation),
         input.segmentation == StreamUse::kRequired);
  }
  return lines;
}

}  // namespace pocd

// A recording as a source of frames: the same streams, transforms and merging as on the bus, fed in
// the order of the recording and without a clock.
#include <algorithm>
#include <optional>
#include <set>

#include "live_frames.hpp"
#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"
#include "pocd/input/frame_merger.hpp"
#include "pocd/input/robot_streams.hpp"
#include "pocd/recording/recording_files.hpp"
#include "pocd/recording/ros_messages.hpp"
#include "recorded_topics.hpp"

namespace pocd {
namespace {

using namespace recording;  // NOLINT: this file is about nothing else
using Stream = TimeSynchronizer::Stream;

// A robot that lags this many frames behind the others has none in this stretch.
constexpr std::size_t kMostBehind = 64;
// Between two runs: longer than poses are interpolated over.
constexpr StampNs kPause = 1'000'000'000;

class RecordingDataset : public DatasetReader {
 public:
  explicit RecordingDataset(const DatasetOptions& options)
      : input_(options.input),
        labels_(options.classes),
        topics_(input_),
        counter_([this](const ProblemCounter::Entry& entry) { tell(entry); }),
        transforms_(static_cast<StampNs>(input_.max_pose_gap_s * 1e9)),
        files_(options.inputs),
        merger_(std::nullopt) {
    find_robots(options.max_depth_m);
    if (options.as_live) live_ = LiveFrames(files_.paths());
  }

  std::size_t size() const override { return frames_listed_; }

  std::optional<Frame> next() override {
    while (true) {
      std::optional<Frame> frame = next_recorded();
      if (!live_) return frame;
      if (!frame) {
        frame = live_->take_last();
        if (!frame) report_missing();
        return frame;
      }
      live_->add(std::move(*frame));
      if (std::optional<Frame> ready = live_->take()) return ready;
    }
  }

 private:
  using Feeds = std::vector<InputTopic>;

  /// Looks at the channels of all files, so that a robot is known before its first message.
  void find_robots(double max_depth_m) {
    std::set<std::string> robots;
    std::string damage;
    for (std::size_t i = 0; i < files_.size(); ++i) {
      const RecordingReader& reader = files_.reader(i);
      if (!reader.problems().empty()) damage += "; " + reader.problems().front();
      for (const RecordedChannel& channel : reader.channels()) {
        const std::string topic = bus_name(channel.topic);
        seen_.push_back({{topic, ros_type_name(channel.type)}, channel.messages > 0});
        for (const InputTopic& to : topics_.find(topic)) {
          if (to.stream != InputStream::kDepth || !fits(channel, to.stream)) continue;
          robots.insert(to.robot);
          frames_listed_ += channel.messages;
        }
      }
    }
    if (robots.empty()) {
      throw InputError(files_.path(0).string() + ": no depth images on " +
                       bus_name(input_.topics.depth) + " (node.topics.depth); " +
                       suggestion_text(recorded_topics(seen_)) + damage);
    }
    const StreamContext context{input_, labels_, max_depth_m, transforms_, counter_};
    for (const std::string& name : robots) {
      RobotConfig config;
      config.name = name;
      for (const RobotConfig& named : input_.robots) {
        if (named.name == name) config = named;
      }
      robots_.emplace(name, std::make_unique<RobotStreams>(config, context));
      merger_.set_live(name, true);
    }
    for (const RobotConfig& named : input_.robots) {
      if (robots_.count(named.name) > 0) continue;
      skip(files_.path(0).string() + ": " + named.name + ": no depth images on " +
           topic_of(input_, named, InputStream::kDepth) + "; " +
           suggestion_text(recorded_topics(seen_)));
    }
    count_what_comes();
  }

  /// What there is will come, however far other streams run ahead; what has ended will not.
  void count_what_comes() {
    for (auto& [name, robot] : robots_) robot->synchronizer().set_patience(Patience::kEndless);
    for (std::size_t i = 0; i < files_.size(); ++i) {
      for (const RecordedChannel& channel : files_.reader(i).channels()) {
        for (const InputTopic& to : feeds_of(channel)) count(to, channel.messages);
      }
    }
    for (auto& [name, robot] : robots_) {
      for (const Stream stream : {Stream::kSegmentation, Stream::kColor, Stream::kCameraInfo}) {
        if (left_[{name, stream}] > 0) continue;
        robot->synchronizer().set_patience(stream, Patience::kNone);
      }
    }
  }

  void count(const InputTopic& to, std::uint64_t messages) {
    for (const auto& [name, robot] : robots_) {
      if (to.robot.empty() || to.robot == name) left_[{name, stream_of(to.stream)}] += messages;
    }
  }

  void came(const InputTopic& to) {
    for (const auto& [name, robot] : robots_) {
      if (!to.robot.empty() && to.robot != name) continue;
      std::uint64_t& left = left_[{name, stream_of(to.stream)}];
      if (left > 0 && --left == 0) {
        robot->synchronizer().set_patience(stream_of(to.stream), Patience::kNone);
      }
    }
  }

  Feeds feeds_of(const RecordedChannel& channel) const {
    Feeds feeds;
    if (channel.message_encoding != "cdr" || channel.metadata.count("instances_of") > 0) return {};
    for (const InputTopic& to : topics_.find(bus_name(channel.topic))) {
      const bool known = to.robot.empty() || robots_.count(to.robot) > 0;
      if (known && fits(channel, to.stream)) feeds.push_back(to);
    }
    return feeds;
  }

  /// What would feed something, were it of another kind.
  void name_misfits(const RecordedChannel& channel) {
    if (channel.messages == 0 || channel.metadata.count("instances_of") > 0) return;
    const std::string topic = bus_name(channel.topic);
    for (const InputTopic& to : topics_.find(topic)) {
      if (const auto problem = misfit(channel, to.stream)) counter_.count(topic, *problem);
    }
  }

  bool open_next_file() {
    if (reader_ != nullptr) files_.close(next_file_ - 1);
    reader_ = nullptr;
    if (next_file_ == files_.size()) return false;
    file_ = files_.path(next_file_).string();
    reader_ = &files_.reader(next_file_++);
    feeds_.clear();
    reported_ = 0;
    message_.reset();
    for (const RecordedChannel& channel : reader_->channels()) name_misfits(channel);
    // The parts of one recording follow each other; another run is moved behind the one before.
    const std::optional<StampNs> last_ns = last_stamp();
    if (last_ns) {
      const std::optional<StampNs> first_ns = first_stamp();
      if (first_ns && *first_ns + shift_ns_ <= *last_ns) {
        shift_ns_ = *last_ns + kPause - *first_ns;
        tell_shift(*first_ns);
      }
    }
    reader_->select([this](const RecordedChannel& channel) { return !feeds_of(channel).empty(); });
    reader_->seek(0);
    return true;
  }

  void tell_shift(StampNs first_ns) {
    problems_.push_back(file_ + ": begins at " + std::to_string(first_ns) +
                        " ns, before the file before it ended: taken as another run, " +
                        std::to_string(shift_ns_) +
                        " ns later (of one recording, give the files in their order)");
  }

  /// Stamp of the latest depth image of the run so far.
  std::optional<StampNs> last_stamp() const {
    std::optional<StampNs> last_ns;
    for (const auto& [name, robot] : robots_) {
      last_ns = std::max(last_ns, robot->synchronizer().newest_ns(Stream::kDepth));
    }
    return last_ns;
  }

  std::optional<StampNs> first_stamp() {
    reader_->select([this](const RecordedChannel& channel) {
      const Feeds feeds = feeds_of(channel);
      return std::any_of(feeds.begin(), feeds.end(),
                         [](const InputTopic& to) { return to.stream == InputStream::kDepth; });
    });
    RecordedMessage message;
    for (reader_->seek(0); reader_->next(message);) {
      try {
        return image_of(message).header.stamp_ns;
      } catch (const DamagedData&) {
      }
    }
    return std::nullopt;
  }

  RosImage image_of(const RecordedMessage& message) const {
    const bool compressed = ros_type_name(reader_->channels()[message.channel].type) ==
                            ros_type(InputStream::kDepth, true);
    return compressed ? decode_compressed_image(message.data, message.size)
                      : decode_image(message.data, message.size);
  }

  void report_damage() {
    for (; reported_ < reader_->problems().size(); ++reported_) {
      problems_.push_back(reader_->problems()[reported_]);
    }
    const std::uint64_t untold = reader_->problem_count() - reader_->problems().size();
    if (untold > 0) {
      problems_.push_back(file_ + ": " + std::to_string(untold) + " more of its problems");
    }
  }

  const Feeds& feeds(std::size_t channel) {
    while (feeds_.size() <= channel) {
      feeds_.push_back(feeds_of(reader_->channels()[feeds_.size()]));
    }
    return feeds_[channel];
  }

  void add(const RecordedMessage& message) {
    const std::uint64_t refused_before = counter_.refused();
    message_ = message;
    for (const InputTopic& to : feeds(message.channel)) {
      try {
        add(message, to);
      } catch (const DamagedData& damage) {
        counter_.count(bus_name(reader_->channels()[message.channel].topic), "damaged",
                       std::string(damage.what()) + " (byte " + std::to_string(damage.offset()) +
                           " of the payload)",
                       1);
        ++skipped_;
      }
      came(to);
    }
    message_.reset();
    skipped_ += counter_.refused() - refused_before;
  }

  void add(const RecordedMessage& message, const InputTopic& to) {
    RobotStreams* robot =
        to.robot.empty() && robots_.count("") == 0 ? nullptr : robots_.at(to.robot).get();
    switch (to.stream) {
      case InputStream::kDepth:
      case InputStream::kSegmentation:
      case InputStream::kColor: {
        const RosImage image = image_of(message);
        robot->add_image(stream_of(to.stream), image.header.stamp_ns + shift_ns_,
                         image.header.frame_id, view_of(image));
        return;
      }
      case InputStream::kCameraInfo: {
        const RosCameraInfo info = decode_camera_info(message.data, message.size);
        const StampNs stamp_ns = info.header.stamp_ns;
        robot->add_camera_info(stamp_ns == 0 ? 0 : stamp_ns + shift_ns_, camera_model(info.fields));
        return;
      }
      case InputStream::kOdometry:
        robot->add_odometry(shifted(decode_odometry(message.data, message.size)));
        return;
      case InputStream::kTf:
      case InputStream::kTfStatic: {
        const bool is_static = to.stream == InputStream::kTfStatic;
        statics_ += is_static;
        const bool shared = to.robot.empty() && !input_.topics.own_tf();
        TransformTree& tree = shared ? transforms_ : robot->own_transforms();
        const std::string topic = bus_name(reader_->channels()[message.channel].topic);
        for (const RosTransform& transform : decode_tf(message.data, message.size)) {
          add_transform(shifted(transform), is_static, topic, tree, counter_);
        }
      }
    }
  }

  Checked<StampedTransform> shifted(const RosTransform& message) const {
    return checked_transform({message.header.frame_id, message.child_frame_id,
                              message.header.stamp_ns + shift_ns_, message.T});
  }

  void collect(bool last_call) {
    for (auto& [name, robot] : robots_) {
      for (Frame& frame : robot->take(last_call)) {
        const StampNs stamp_ns = frame.stamp_ns;
        merger_.add(name, stamp_ns, std::move(frame));
      }
      merger_.set_watermark(name, robot->synchronizer().watermark_ns());
    }
  }

  /// The next frame of the recording, in the order of stamps.
  std::optional<Frame> next_recorded() {
    while (true) {
      const bool far_behind = std::any_of(robots_.begin(), robots_.end(), [&](const auto& robot) {
        return merger_.pending(robot.first) >= kMostBehind;
      });
      if (auto frame = merger_.take(ended_ || far_behind)) return frame;
      if (ended_) return std::nullopt;
      RecordedMessage message;
      if (reader_ != nullptr && reader_->next(message)) {
        add(message);
        collect(false);
        continue;
      }
      if (reader_ != nullptr) report_damage();
      if (open_next_file()) continue;
      ended_ = true;
      collect(true);
      report_losses();
    }
  }

  void report_losses() {
    bool no_transform = false;
    for (const ProblemCounter::Entry& entry : counter_.entries()) {
      no_transform = no_transform || entry.reason == to_string(InputReason::kNoTransform);
      if (entry.count == 1) continue;
      problems_.push_back(entry.topic + ": " + entry.reason + ": " + std::to_string(entry.count) +
                          " times in all");
    }
    const bool beside = std::any_of(seen_.begin(), seen_.end(), [&](const SeenTopic& topic) {
      return topic.has_messages && topic.info.type == ros_type(InputStream::kTfStatic) &&
             topic.info.topic.find("tf_static") != std::string::npos;
    });
    if (no_transform && statics_ == 0 && !beside) {
      problems_.push_back(
          bus_name(input_.topics.tf_static) +
          ": the recording has no message on it: it is sent once, at the beginning, "
          "so of a split recording the first part has it");
    }
    for (const auto& [name, robot] : robots_) {
      for (std::string& line : absent_streams(*robot, input_, seen_)) {
        problems_.push_back(std::move(line));
      }
      const std::string losses = robot->losses();
      if (!losses.empty()) problems_.push_back(losses);
      skipped_ += robot->dropped();
    }
  }

  void tell(const ProblemCounter::Entry& entry) {
    const std::string at =
        message_ ? " at " + std::to_string(message_->log_time_ns) + " ns" : std::string();
    problems_.push_back((file_.empty() ? "" : file_ + ": ") + entry.topic + at + ": " +
                        entry.reason + ": " + entry.detail);
  }

  void report_missing() {
    if (told_missing_ || live_->missing() == 0) return;
    told_missing_ = true;
    skip(files_.path(0).string() + ": " + std::to_string(live_->missing()) +
         " frames were processed live, but the recording does not give them");
  }

  const InputConfig input_;
  const LabelTable labels_;
  const InputTopics topics_;
  ProblemCounter counter_;
  TransformTree transforms_;  // of the topics that all robots share
  RecordingFiles files_;
  std::map<std::string, std::unique_ptr<RobotStreams>> robots_;
  std::map<std::pair<std::string, Stream>, std::uint64_t> left_;  // messages still to come
  FrameMerger<Frame> merger_;
  std::vector<SeenTopic> seen_;  // of all files
  std::size_t frames_listed_ = 0;
  std::uint64_t statics_ = 0;
  std::optional<LiveFrames> live_;
  bool told_missing_ = false;

  std::size_t next_file_ = 0;
  std::string file_;
  RecordingReader* reader_ = nullptr;
  std::optional<RecordedMessage> message_;  // being added
  std::vector<Feeds> feeds_;
  std::size_t reported_ = 0;
  StampNs shift_ns_ = 0;
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<DatasetReader> open_recorded(const DatasetOptions& options) {
  return std::make_unique<RecordingDataset>(options);
}

}  // namespace pocd

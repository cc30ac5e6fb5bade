// A recording as a source of frames: the same synchroniser, transforms and merging as on the bus,
// fed in the order of the recording and without a clock.
#include <algorithm>
#include <deque>
#include <optional>

#include "live_frames.hpp"
#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"
#include "pocd/input/frame_merger.hpp"
#include "pocd/input/message_checks.hpp"
#include "pocd/input/robot_topic.hpp"
#include "pocd/recording/recording_reader.hpp"
#include "pocd/recording/ros_messages.hpp"
#include "recorded_robot.hpp"

namespace pocd {
namespace {

using namespace recording;  // NOLINT: this file is about nothing else
using Stream = TimeSynchronizer::Stream;

// A robot that lags this many frames behind the others has none in this stretch.
constexpr std::size_t kMostBehind = 64;
// Between two runs: longer than poses are interpolated over.
constexpr StampNs kPause = 1'000'000'000;

/// Throws what is wrong.
template <class T>
T good(Checked<T> checked) {
  if (checked.problem) throw InputError(checked.problem->detail);
  return std::move(*checked.value);
}

enum class Use { kNone, kImage, kCameraInfo, kOdometry, kTf, kTfStatic };

/// What one channel feeds.
struct Feed {
  Use use = Use::kNone;
  Stream stream = Stream::kDepth;
  std::string robot;
};

class RecordingDataset : public DatasetReader {
 public:
  explicit RecordingDataset(const DatasetOptions& options)
      : options_(options.recording),
        colours_(options.classes),
        with_color_(options.with_color),
        merger_(std::nullopt) {
    for (const auto& input : options.inputs) {
      for (const auto& file : recording_files(input)) files_.push_back(file);
    }
    find_robots();
    if (options_.as_live) live_ = LiveFrames(files_);
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
  /// Looks at the channels of all files, so that a robot is known before its first message.
  void find_robots() {
    std::map<std::string, RecordedStreams> robots;
    std::vector<std::string> depth_topics;
    for (const auto& file : files_) {
      const auto reader = open_recording(file);
      for (const RecordedChannel& channel : reader->channels()) {
        if (channel.type != "sensor_msgs/msg/Image") continue;
        if (const auto robot = robot_in(options_.depth, channel.topic)) {
          robots[*robot];
          frames_listed_ += channel.messages;
        }
      }
      for (const RecordedChannel& channel : reader->channels()) {
        if (channel.messages == 0) continue;
        for (auto& [name, streams] : robots) {
          streams.segmentation |= robot_in(options_.segmentation, channel.topic) == name;
          streams.color |= with_color_ && robot_in(options_.color, channel.topic) == name;
        }
      }
    }
    if (robots.empty()) {
      throw InputError(files_.front().string() + ": no sensor_msgs/msg/Image on a topic " +
                       options_.depth);
    }
    for (const auto& [name, streams] : robots) {
      robots_.emplace(name, std::make_unique<RecordedRobot>(name, options_, streams));
      merger_.set_live(name, true);
    }
  }

  Feed feed_of(const RecordedChannel& channel) const {
    if (channel.message_encoding != "cdr" || is_instance_channel(channel)) return {};
    const auto known = [&](const std::string& pattern) -> std::optional<std::string> {
      const auto robot = robot_in(pattern, channel.topic);
      return robot && robots_.count(*robot) ? robot : std::nullopt;
    };
    if (channel.type == "sensor_msgs/msg/Image") {
      if (const auto robot = known(options_.depth)) return {Use::kImage, Stream::kDepth, *robot};
      if (const auto robot = known(options_.segmentation)) {
        return {Use::kImage, Stream::kSegmentation, *robot};
      }
      const auto robot = known(options_.color);
      if (robot && with_color_) return {Use::kImage, Stream::kColor, *robot};
    } else if (channel.type == "sensor_msgs/msg/CameraInfo") {
      if (const auto robot = known(options_.camera_info)) return {Use::kCameraInfo, {}, *robot};
    } else if (channel.type == "nav_msgs/msg/Odometry") {
      if (const auto robot = known(options_.odometry)) return {Use::kOdometry, {}, *robot};
    } else if (channel.type == "tf2_msgs/msg/TFMessage") {
      if (channel.topic == "/tf") return {Use::kTf, {}, ""};
      if (channel.topic == "/tf_static") return {Use::kTfStatic, {}, ""};
    }
    return {};
  }

  static bool is_instance_channel(const RecordedChannel& channel) {
    return channel.metadata.count("instances_of") > 0;
  }

  /// False when there is no other file.
  bool open_next_file() {
    if (next_file_ == files_.size()) return false;
    file_ = files_[next_file_++].string();
    reader_ = open_recording(file_);
    feeds_.clear();
    reader_->select(
        [this](const RecordedChannel& channel) { return feed_of(channel).use != Use::kNone; });
    reader_->seek(0);
    reported_ = 0;
    // The parts of one recording follow each other; another run is moved behind the one before.
    const std::optional<StampNs> first_ns = first_stamp(file_);
    const std::optional<StampNs> last_ns = last_stamp();
    if (first_ns && last_ns && *first_ns + shift_ns_ <= *last_ns) {
      shift_ns_ = *last_ns + kPause - *first_ns;
    }
    return true;
  }

  /// Stamp of the latest depth image of the run so far.
  std::optional<StampNs> last_stamp() const {
    std::optional<StampNs> last_ns;
    for (const auto& [name, robot] : robots_) last_ns = std::max(last_ns, robot->newest_ns());
    return last_ns;
  }

  /// Stamp of the first depth image in a file.
  std::optional<StampNs> first_stamp(const std::string& file) const {
    const auto reader = open_recording(file);
    reader->select([this](const RecordedChannel& channel) {
      const Feed to = feed_of(channel);
      return to.use == Use::kImage && to.stream == Stream::kDepth;
    });
    RecordedMessage message;
    for (reader->seek(0); reader->next(message);) {
      try {
        return decode_image(message.data, message.size).header.stamp_ns;
      } catch (const DamagedData&) {
      }
    }
    return std::nullopt;
  }

  void report_damage() {
    for (; reported_ < reader_->problems().size(); ++reported_) {
      problems_.push_back(reader_->problems()[reported_]);
    }
  }

  const Feed& feed(std::size_t channel) {
    while (feeds_.size() <= channel) feeds_.push_back(feed_of(reader_->channels()[feeds_.size()]));
    return feeds_[channel];
  }

  void add(const RecordedMessage& message) {
    const Feed& to = feed(message.channel);
    const auto robot = robots_.find(to.robot);
    switch (to.use) {
      case Use::kNone:
        return;
      case Use::kImage: {
        const RosImage image = decode_image(message.data, message.size);
        cv::Mat pixels = to.stream == Stream::kDepth ? good(depth_image(view_of(image)))
                         : to.stream == Stream::kColor
                             ? good(color_image(view_of(image)))
                             : good(label_image(view_of(image), colours_)).labels;
        say(message, robot->second->add_image(to.stream, image.header.stamp_ns + shift_ns_,
                                              image.header.frame_id, std::move(pixels)));
        return;
      }
      case Use::kCameraInfo: {
        const RosCameraInfo info = decode_camera_info(message.data, message.size);
        say(message,
            robot->second->add_camera_info(info.header.stamp_ns + shift_ns_,
                                           good(camera_model(info.width, info.height, info.k))));
        return;
      }
      case Use::kOdometry:
        say(message, robot->second->add_odometry(
                         good(shifted(decode_odometry(message.data, message.size)))));
        return;
      case Use::kTf:
      case Use::kTfStatic:
        for (const RosTransform& transform : decode_tf(message.data, message.size)) {
          add_transform(message, shifted(transform), to.use == Use::kTfStatic);
        }
    }
  }

  /// One of a message's transforms; what is wrong with it costs the others nothing.
  void add_transform(const RecordedMessage& message, const Checked<StampedTransform>& transform,
                     bool is_static) {
    std::optional<InputProblem> problem = transform.problem;
    if (transform.value) {
      for (auto& [name, any] : robots_) {  // all are told the same, so one of them may say it
        const auto found = any->add_transform(*transform.value, is_static);
        if (found) problem = found;
      }
    }
    say(message, problem);
  }

  Checked<StampedTransform> shifted(const RosTransform& message) const {
    return checked_transform({message.header.frame_id, message.child_frame_id,
                              message.header.stamp_ns + shift_ns_, message.T});
  }

  void collect(bool last_call) {
    for (auto& [name, robot] : robots_) {
      const std::size_t before = problems_.size();
      for (Frame& frame : robot->take(last_call, problems_)) {
        const StampNs stamp_ns = frame.stamp_ns;
        merger_.add(name, stamp_ns, std::move(frame));
      }
      skipped_ += problems_.size() - before;
      merger_.set_watermark(name, robot->watermark_ns());
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
      if (reader_ && reader_->next(message)) {
        try {
          add(message);
        } catch (const DamagedData& damage) {
          skip_message(message, std::string(damage.what()) + " (byte " +
                                    std::to_string(damage.offset()) + " of the payload)");
        } catch (const InputError& error) {
          skip_message(message, error.what());
        }
        collect(false);
        continue;
      }
      if (reader_) report_damage();
      if (open_next_file()) continue;
      ended_ = true;
      collect(true);
      for (const auto& [name, robot] : robots_) {
        const std::string losses = robot->losses();
        if (!losses.empty()) problems_.push_back(losses);
        skipped_ += robot->dropped();
      }
    }
  }

  std::string about(const RecordedMessage& message, const std::string& problem) const {
    return file_ + ": " + reader_->channels()[message.channel].topic + " at " +
           std::to_string(message.log_time_ns) + " ns: " + problem;
  }

  void skip_message(const RecordedMessage& message, const std::string& problem) {
    skip(about(message, problem));
  }

  /// What was taken in spite of it is no message less.
  void say(const RecordedMessage& message, const std::optional<InputProblem>& problem) {
    if (!problem) return;
    const bool taken = used_anyway(*problem);
    if (taken) {
      problems_.push_back(about(message, problem->detail));
    } else {
      skip_message(message, problem->detail);
    }
  }

  void report_missing() {
    if (told_missing_ || live_->missing() == 0) return;
    told_missing_ = true;
    skip(files_.front().string() + ": " + std::to_string(live_->missing()) +
         " frames were processed live, but the recording does not give them");
  }

  RecordingOptions options_;
  ColourTable colours_;
  bool with_color_;
  std::vector<std::filesystem::path> files_;
  std::map<std::string, std::unique_ptr<RecordedRobot>> robots_;
  FrameMerger<Frame> merger_;
  std::size_t frames_listed_ = 0;
  std::optional<LiveFrames> live_;
  bool told_missing_ = false;

  std::size_t next_file_ = 0;
  std::string file_;
  std::unique_ptr<RecordingReader> reader_;
  std::vector<Feed> feeds_;
  std::size_t reported_ = 0;
  StampNs shift_ns_ = 0;
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<DatasetReader> open_recorded(const DatasetOptions& options) {
  return std::make_unique<RecordingDataset>(options);
}

}  // namespace pocd

#include "pocd_dds/play/player.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <cmath>
#include <opencv2/core.hpp>
#include <thread>

#include "nav_msgsPubSubTypes.h"
#include "pocd/common/check.hpp"
#include "sensor_msgsPubSubTypes.h"
#include "tf2_msgsPubSubTypes.h"

namespace pocd::dds {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPoll{20};
constexpr std::chrono::milliseconds kLastAcknowledgement{30000};

// A reliable writer that keeps the last few matches best effort and reliable readers alike.
constexpr Delivery kImages{true, false, 5, 0, 0, false, 0};
constexpr Delivery kPoses{true, false, 100, 0, 0, false, 0};
constexpr Delivery kLossless{true, false, 0, 64, 0, false, 0};
constexpr Delivery kStatic{true, true, 1, 0, 0, false, 0};

/// How long something may be waited for.
struct Until {
  const std::atomic<bool>& stop;
  Clock::time_point deadline = Clock::time_point::max();
  bool over() const { return stop || Clock::now() >= deadline; }
};

/// The image in millimetres, where that loses nothing: half the bytes, and what cameras send.
std::optional<cv::Mat> exact_millimetres(const cv::Mat& depth_m) {
  cv::Mat millimetres(depth_m.rows, depth_m.cols, CV_16UC1);
  for (int row = 0; row < depth_m.rows; ++row) {
    const auto* in = depth_m.ptr<float>(row);
    auto* out = millimetres.ptr<std::uint16_t>(row);
    for (int col = 0; col < depth_m.cols; ++col) {
      const float value = in[col] > 0.0f ? in[col] : 0.0f;
      const float rounded = std::nearbyint(value * 1000.0f);
      if (!(rounded < 65535.0f)) return std::nullopt;
      out[col] = static_cast<std::uint16_t>(rounded);
      if (static_cast<float>(out[col]) * 0.001f != value) return std::nullopt;
    }
  }
  return millimetres;
}

}  // namespace

/// The topics of one robot.
class Player::Robot {
 public:
  Robot(const PlayOptions& options, const std::shared_ptr<Participant>& participant,
        const std::string& name, const CameraExtrinsics& extrinsics, const Frame& first)
      : map_frame_(options.map_frame),
        base_frame_(name + "/" + extrinsics.base_frame),
        camera_frame_(name + "/" + extrinsics.camera_frame),
        T_B_C_(extrinsics.T_B_C),
        odometry_(participant, topics::kOdometry, robot_topic(options.topics.odometry, name),
                  options.lossless ? kLossless : kPoses),
        camera_info_(participant, topics::kCameraInfo,
                     robot_topic(options.topics.camera_info, name),
                     options.lossless ? kLossless : kImages),
        segmentation_(first.labels.empty()
                          ? nullptr
                          : image_writer(options, participant, name, topics::kSegmentation,
                                         options.topics.segmentation)),
        color_(first.color.empty() ? nullptr
                                   : image_writer(options, participant, name, topics::kColor,
                                                  options.topics.color)),
        depth_(participant, topics::kDepth, robot_topic(options.topics.depth, name),
               options.lossless ? kLossless : kImages),
        tf_static_(participant, topics::kTfStatic, topics::kTfStatic.name, kStatic) {}

  bool has_readers() const { return depth_.matched() > 0; }
  const std::string& depth_topic() const { return depth_.topic(); }

  /// Also a barrier: this writer was announced last, so a reader that acknowledges knows all the
  /// others; and what was sent before, even to best-effort readers, has been received by then.
  bool send_mount(const Until& until) {
    tf2_msgs::msg::TFMessage message;
    message.transforms().push_back(
        transform_message({base_frame_, camera_frame_, 0, to_quaternion(T_B_C_)}));
    tf_static_.write(message);
    return acknowledged(tf_static_, until);
  }

  void send(const Frame& frame) {
    auto odometry = odometry_message(
        {map_frame_, base_frame_, frame.stamp_ns, to_quaternion(frame.T_W_C * T_B_C_.inverse())});
    odometry_.write(odometry);
    auto info = camera_message(frame.camera, frame.stamp_ns, camera_frame_);
    camera_info_.write(info);
    if (segmentation_ && !frame.labels.empty()) {
      double largest = 0.0;
      cv::minMaxLoc(frame.labels, nullptr, &largest);
      cv::Mat labels = frame.labels;
      if (largest < 256) frame.labels.convertTo(labels, CV_8U);
      auto message =
          image_message(labels, largest < 256 ? "mono8" : "mono16", frame.stamp_ns, camera_frame_);
      segmentation_->write(message);
    }
    if (color_ && !frame.color.empty() && color_->matched() > 0) {
      auto message = image_message(frame.color, "bgr8", frame.stamp_ns, camera_frame_);
      color_->write(message);
    }
    const std::optional<cv::Mat> millimetres = exact_millimetres(frame.depth_m);
    auto depth = image_message(millimetres ? *millimetres : frame.depth_m,
                               millimetres ? "16UC1" : "32FC1", frame.stamp_ns, camera_frame_);
    depth_.write(depth);
  }

  bool acknowledged(const Until& until) {
    return acknowledged(odometry_, until) && acknowledged(camera_info_, until) &&
           (!segmentation_ || acknowledged(*segmentation_, until)) &&
           (!color_ || acknowledged(*color_, until)) && acknowledged(depth_, until);
  }

 private:
  using ImageWriter = Writer<sensor_msgs::msg::ImagePubSubType>;

  static std::unique_ptr<ImageWriter> image_writer(const PlayOptions& options,
                                                   const std::shared_ptr<Participant>& participant,
                                                   const std::string& name, const TopicSpec& spec,
                                                   const std::string& pattern) {
    return std::make_unique<ImageWriter>(participant, spec, robot_topic(pattern, name),
                                         options.lossless ? kLossless : kImages);
  }
  template <class AnyWriter>
  static bool acknowledged(AnyWriter& writer, const Until& until) {
    while (!until.over()) {
      if (writer.wait_acknowledged(std::chrono::milliseconds(100))) return true;
    }
    return false;
  }

  std::string map_frame_, base_frame_, camera_frame_;
  Pose T_B_C_;
  Writer<nav_msgs::msg::OdometryPubSubType> odometry_;
  Writer<sensor_msgs::msg::CameraInfoPubSubType> camera_info_;
  // Null where the source has no such images: an announced topic that stays silent would be waited
  // for.
  std::unique_ptr<ImageWriter> segmentation_, color_;
  ImageWriter depth_;
  Writer<tf2_msgs::msg::TFMessagePubSubType> tf_static_;
};

Player::Player(const PlayOptions& options, std::unique_ptr<DatasetReader> reader)
    : options_(options),
      participant_(std::make_shared<Participant>(options.bus)),
      reader_(std::move(reader)) {
  if (options.clock) {
    clock_ =
        std::make_unique<Writer<rosgraph_msgs::msg::ClockPubSubType>>(participant_, topics::kClock);
  }
}

Player::~Player() = default;

Player::Robot& Player::robot(const std::string& name, const Frame& first,
                             const std::atomic<bool>& stop) {
  std::unique_ptr<Robot>& robot = robots_[name];
  if (robot) return *robot;
  robot = std::make_unique<Robot>(options_, participant_, name, reader_->extrinsics(), first);
  if (options_.wait_for_readers) {
    if (!robot->has_readers()) spdlog::info("waiting for a reader of {}", robot->depth_topic());
    while (!robot->has_readers() && !stop) std::this_thread::sleep_for(kPoll);
  }
  robot->send_mount({stop});
  return *robot;
}

PlayResult Player::run(const std::atomic<bool>& stop) {
  PlayResult result;
  std::optional<StampNs> first_ns;
  Clock::time_point start{};
  std::size_t reported = 0;
  while (!stop && !(options_.max_frames && result.frames >= *options_.max_frames)) {
    const std::optional<Frame> frame = reader_->next();
    for (; reported < reader_->problems().size(); ++reported) {
      spdlog::warn("skipped: {}", reader_->problems()[reported]);
    }
    if (!frame) break;
    const std::string name = frame->robot.empty() ? options_.robot : frame->robot;
    const auto before = Clock::now();
    Robot& out = robot(name, *frame, stop);
    if (!first_ns) {
      first_ns = frame->stamp_ns;
      start = Clock::now();
    } else {
      start += Clock::now() - before;  // another robot's readers were waited for: all go on later
    }
    if (options_.speed) {
      const double due_s =
          static_cast<double>(frame->stamp_ns - *first_ns) * 1e-9 / *options_.speed;
      const auto due =
          start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(due_s));
      while (!stop && Clock::now() < due) {
        std::this_thread::sleep_for(std::min<Clock::duration>(due - Clock::now(), kPoll));
      }
    }
    if (stop) break;
    if (clock_) {
      rosgraph_msgs::msg::Clock message;
      message.clock(to_time(frame->stamp_ns));
      clock_->write(message);
    }
    out.send(*frame);
    if (options_.lossless && !out.acknowledged({stop})) break;
    ++result.frames;
  }
  result.stopped = stop;
  result.skipped = reader_->skipped();
  const Until until{stop, Clock::now() + kLastAcknowledgement};
  for (auto& [name, out] : robots_) {
    result.acknowledged = out->acknowledged(until) && out->send_mount(until) && result.acknowledged;
  }
  return result;
}

}  // namespace pocd::dds

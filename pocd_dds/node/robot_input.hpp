// The streams of one robot: readers, checks, synchroniser.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nav_msgsPubSubTypes.h"
#include "pocd/input/frame.hpp"
#include "pocd/input/time_synchronizer.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/image_visit.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/node/latency_log.hpp"
#include "pocd_dds/node/node_config.hpp"
#include "pocd_dds/node/transform_input.hpp"
#include "sensor_msgsPubSubTypes.h"

namespace pocd::dds {

/// Used by the intake thread only. Clocks are read only to tell how long a stream has been silent.
class RobotInput {
 public:
  using Clock = std::chrono::steady_clock;

  /// `shared` has the transforms of the topics that all robots share. It, `colours`, `problems`,
  /// `wakeup` and `latency` must outlive it. Throws InputError naming the topic when there can be
  /// no reader.
  RobotInput(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
             const RobotConfig& robot, const ColourTable& colours, const TransformTree& shared,
             ProblemCounter& problems, Wakeup& wakeup, LatencyLog& latency);

  const std::string& name() const { return robot_.name; }

  enum class Turn {
    kUsual,
    kHold,  ///< images stay with their readers, to hold the sender back
    kLast   ///< all that has arrived is taken, and nothing is waited for
  };
  // A turn is these three, one after the other.

  /// Looks whether the source of the images is there. To be called before anything is taken, here
  /// or from the shared transforms: what a source that has gone had sent is with the readers then.
  void look(Turn turn);
  /// Takes what has arrived. `shared_moved` are the frames that moved in the shared transforms.
  void drain(const std::set<std::string>& shared_moved);
  /// Frames that are ready, by stamp. Once the source of the images has gone, nothing is waited for
  /// any more.
  std::vector<Frame> take();

  /// After take(): once when the source of depth images has gone and nothing of it is left, the
  /// robot's frames from the camera up to the map, as far as they are known. The next source may
  /// start at any stamp.
  std::optional<std::vector<std::string>> settle_departure();

  /// No departed source has left anything to be settled.
  bool settled() const { return !had_source_; }

  /// A source of depth images is there.
  bool live() const { return depth_->matched() > 0; }
  /// How long no depth image has come although there is a source [s]; 0 without one.
  double silent_s() const;

  /// Images are waiting, for other streams or for poses.
  bool waits() const { return synchronizer_.pending() > 0; }
  StampNs watermark_ns() const { return synchronizer_.watermark_ns(); }
  /// Depth images that came, good or bad.
  std::uint64_t images() const { return images_; }
  std::uint64_t frames() const { return frames_; }
  /// Frames that were dropped for something they lacked.
  std::uint64_t dropped() const;
  /// Images that the bus says were lost on the way.
  std::uint64_t lost() const;
  /// CPU time that taking images from the bus and converting them took so far [ms].
  double take_cpu_ms() const { return take_cpu_ms_; }
  /// What its frames wait for, or go on without; "" when nothing is wrong.
  std::string waiting_for() const;
  const SynchronizerCounts& counts() const { return synchronizer_.counts(); }

 private:
  using ImageReader = Reader<ImageVisitType>;
  using Stream = TimeSynchronizer::Stream;

  /// Nothing comes after this turn: all that the readers hold is taken, and all frames come out.
  bool ending() const { return turn_ == Turn::kLast || source_left_; }
  void drain_poses();
  void drain_camera_info();
  void hear_transforms(const std::set<std::string>& moved);
  void drain_images(Stream stream, ImageReader& reader);
  /// An image of a stream as the synchroniser takes it, or what is wrong with it.
  struct ConvertedImage {
    recording::RosHeader header;
    cv::Mat image;
    std::optional<InputProblem> problem;
    std::uint64_t unknown_pixels = 0;
  };
  ConvertedImage convert(Stream stream, const recording::RosImage& message) const;
  void add_image(Stream stream, ConvertedImage&& converted, std::int64_t received_ns,
                 const std::string& topic);
  bool accept_camera_frame(const std::string& frame, const std::string& topic);
  void heard(Stream stream);
  void judge_silence();
  void set_patience();
  std::string topic_of(Stream stream) const;

  RobotConfig robot_;
  const std::string map_frame_, tf_topic_;
  const bool lossless_;
  const double silent_wait_s_;
  std::string camera_frame_;           ///< "" until the first depth image
  std::optional<CameraModel> camera_;  ///< as its source said last
  const ColourTable& colours_;
  ProblemCounter& problems_;
  Wakeup& wakeup_;
  LatencyLog& latency_;
  TransformTree transforms_;
  TimeSynchronizer synchronizer_;
  PoseQuaternion mount_;
  Turn turn_ = Turn::kUsual;
  bool had_source_ = false, source_left_ = false;
  std::uint64_t frames_ = 0, images_ = 0;
  std::uint64_t refused_ = 0;
  double take_cpu_ms_ = 0.0;
  bool segmentation_required_ = false, color_required_ = false;
  std::map<Stream, Clock::time_point> heard_;
  Clock::time_point moved_on_ = Clock::now();  ///< a frame came out, or few wait
  std::optional<Stream> given_up_;             ///< a silent stream that is not waited for any more

  std::unique_ptr<TransformInput> tf_;  ///< of its own; null when the robots share the topics
  Reader<nav_msgs::msg::OdometryPubSubType> odometry_;
  Reader<sensor_msgs::msg::CameraInfoPubSubType> camera_info_;
  std::unique_ptr<ImageReader> segmentation_, color_;
  // Made last: endpoints are announced in the order of their making, so a sender that has found
  // this reader knows all the others.
  std::unique_ptr<ImageReader> depth_;
};

}  // namespace pocd::dds

// The streams of one robot: readers, checks, synchroniser.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "nav_msgsPubSubTypes.h"
#include "pocd/input/frame.hpp"
#include "pocd/input/time_synchronizer.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/node/node_config.hpp"
#include "sensor_msgsPubSubTypes.h"

namespace pocd::dds {

/// Used by the intake thread only.
class RobotInput {
 public:
  /// `colours`, `problems` and `wakeup` must outlive it.
  RobotInput(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
             const RobotConfig& robot, const ColourTable& colours, ProblemCounter& problems,
             Wakeup& wakeup);

  const std::string& name() const { return robot_.name; }

  /// Takes what has arrived. `hold`: leaves images with their readers, to hold the sender back.
  void drain(bool hold);
  /// A transform from tf or tf_static. False when its stamp jumped backwards.
  bool add_transform(const StampedTransform& transform, bool is_static);

  /// Frames that are ready, by stamp. Once the source of the images has gone, or with `last_call`,
  /// nothing is waited for any more.
  std::vector<Frame> take(bool last_call);

  /// After take(): true once when the source of depth images has gone and nothing of it is left.
  /// The next source may start at any stamp.
  bool settle_departure();

  /// A source of depth images is there.
  bool live() const { return depth_->matched() > 0; }
  StampNs watermark_ns() const { return synchronizer_.watermark_ns(); }
  std::uint64_t frames() const { return frames_; }
  /// Frames that were dropped for something they lacked.
  std::uint64_t dropped() const;
  /// Images that the bus says were lost on the way.
  std::uint64_t lost() const;
  std::string waiting_for() const { return synchronizer_.waiting_for(); }
  const SynchronizerCounts& counts() const { return synchronizer_.counts(); }

 private:
  using ImageReader = Reader<sensor_msgs::msg::ImagePubSubType>;

  void drain_poses();
  void drain_images(TimeSynchronizer::Stream stream, ImageReader& reader);
  void add_image(TimeSynchronizer::Stream stream, const sensor_msgs::msg::Image& message,
                 const std::string& topic);
  static InputProblem backwards(const std_msgs::msg::Header& header);

  RobotConfig robot_;
  bool lossless_;
  bool camera_frame_known_;
  const ColourTable& colours_;
  ProblemCounter& problems_;
  TransformTree transforms_;
  TimeSynchronizer synchronizer_;
  PoseQuaternion mount_;
  std::set<std::string> odometry_children_;
  bool had_source_ = false, source_left_ = false;
  std::uint64_t frames_ = 0;
  std::uint64_t refused_ = 0;
  bool segmentation_required_ = false, color_required_ = false;
  bool segmentation_delivers_ = false, color_delivers_ = false;

  Reader<nav_msgs::msg::OdometryPubSubType> odometry_;
  Reader<sensor_msgs::msg::CameraInfoPubSubType> camera_info_;
  std::unique_ptr<ImageReader> segmentation_, color_;
  // Made last: endpoints are announced in the order of their making, so a sender that has found
  // this reader knows all the others.
  std::unique_ptr<ImageReader> depth_;
};

}  // namespace pocd::dds

// The streams of one robot as they come over the bus: readers, and who is silent or has gone.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "nav_msgsPubSubTypes.h"
#include "pocd/config/node_config.hpp"
#include "pocd/input/robot_streams.hpp"
#include "pocd_dds/bridge/conversions.hpp"
#include "pocd_dds/bridge/image_visit.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/node/latency_log.hpp"
#include "pocd_dds/node/transform_input.hpp"
#include "sensor_msgsPubSubTypes.h"

namespace pocd::dds {

/// Of a topic whose name says whether its images are compressed.
class ImageReader : public RawReader {
 public:
  ImageReader(const std::shared_ptr<Participant>& participant, InputStream stream,
              const std::string& topic, bool lossless, Wakeup& wakeup);

  /// Calls the visit with the oldest image not taken yet; false when there is none.
  bool take(ImageVisit& visit, SampleMeta& meta) { return take_raw(&visit, meta); }
};

/// Used by the intake thread only. Clocks are read only to tell how long a stream has been silent.
class RobotInput {
 public:
  using Clock = std::chrono::steady_clock;

  /// What `context` refers to, `problems` (the same counter), `wakeup` and `latency` must outlive
  /// it. Throws InputError naming the topic when there can be no reader.
  RobotInput(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
             const RobotConfig& robot, const StreamContext& context, ProblemCounter& problems,
             Wakeup& wakeup, LatencyLog& latency);

  const std::string& name() const { return streams_.name(); }

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
  bool waits() const { return streams_.synchronizer().pending() > 0; }
  StampNs watermark_ns() const { return streams_.synchronizer().watermark_ns(); }
  /// Depth images that came, good or bad.
  std::uint64_t images() const { return images_; }
  std::uint64_t frames() const { return streams_.frames(); }
  /// Frames that were dropped for something they lacked.
  std::uint64_t dropped() const { return streams_.dropped(); }
  /// Depth images left out by node.max_frame_rate_hz.
  std::uint64_t rate_limited() const { return streams_.rate_limited(); }
  /// Images that the bus says were lost on the way.
  std::uint64_t lost() const;
  /// CPU time that taking images from the bus and converting them took so far [ms].
  double take_cpu_ms() const { return take_cpu_ms_; }
  /// What its frames wait for, or go on without; "" when nothing is wrong.
  std::string waiting_for() const;

 private:
  using Stream = TimeSynchronizer::Stream;

  /// Nothing comes after this turn: all that the readers hold is taken, and all frames come out.
  bool ending() const { return turn_ == Turn::kLast || source_left_; }
  void drain_poses();
  void drain_camera_info();
  void hear_transforms(const std::set<std::string>& moved);
  void drain_images(Stream stream, ImageReader& reader);
  void count_lost(Stream stream, const ImageReader& reader);
  void heard(Stream stream);
  void judge_silence();
  void set_patience();

  const bool lossless_;
  const double silent_wait_s_;
  ProblemCounter& problems_;
  Wakeup& wakeup_;
  LatencyLog& latency_;
  RobotStreams streams_;
  Turn turn_ = Turn::kUsual;
  bool had_source_ = false, source_left_ = false;
  std::uint64_t images_ = 0;
  std::map<Stream, std::uint64_t> told_lost_;
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

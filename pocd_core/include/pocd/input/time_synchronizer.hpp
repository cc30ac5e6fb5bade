// Brings the streams of one robot's camera together by stamp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pocd/common/types.hpp"
#include "pocd/input/camera_model.hpp"
#include "pocd/input/input_config.hpp"
#include "pocd/input/stamp_order.hpp"
#include "pocd/input/transform_tree.hpp"

namespace pocd {

/// How long a frame waits for what it lacks of one stream. kBounded: until newer data of the robot
/// is `max_wait_ns` ahead; kEndless (a replay without loss): however far other streams run ahead;
/// kNone: what is not there is missing.
enum class Patience { kBounded, kEndless, kNone };

struct SynchronizerConfig {
  StreamUse segmentation = StreamUse::kOptional;
  StreamUse color = StreamUse::kAbsent;
  /// How far newer data of the robot may run ahead of a frame before what the frame lacks counts as
  /// missing [ns of data time].
  StampNs max_wait_ns = 300'000'000;
  /// Largest difference of stamps that belong together [ns].
  StampNs tolerance_ns = 10'000'000;
  /// How long the newest pose may be held when no later one comes [ns]; 0: never.
  StampNs extrapolation_ns = 0;
  /// Images kept per stream. When so many depth images wait, what the oldest lacks is missing.
  std::size_t capacity = 64;
  std::string map_frame = "map";
  std::string camera_frame = "camera_color_optical_frame";
};

/// One depth image with what belongs to it; images as they came (see make_frame).
struct SyncedFrame {
  StampNs stamp_ns = 0;
  CameraModel camera;
  Pose T_W_C = Pose::Identity();
  cv::Mat depth;
  cv::Mat labels;  ///< empty: went on without
  cv::Mat color;
};

/// What happened to the frames of one robot.
struct SynchronizerCounts {
  std::uint64_t complete = 0;
  std::uint64_t without_segmentation = 0;  ///< emitted, although segmentation was waited for
  std::uint64_t without_color = 0;
  std::uint64_t dropped_no_segmentation = 0;
  std::uint64_t dropped_no_color = 0;
  std::uint64_t dropped_no_camera_info = 0;
  std::uint64_t dropped_no_pose = 0;
  std::uint64_t dropped_overflow = 0;
  std::uint64_t dropped_restart = 0;   ///< from beyond the stamp at which their stream started anew
  std::uint64_t unmatched_images = 0;  ///< segmentation or colour without a depth image
};

/// Streams of one robot. Time is data time only: nothing here reads a clock. Frames come out in the
/// order of their stamps; the oldest one holds up the others until it is complete or its wait is
/// over. Not thread-safe.
class TimeSynchronizer {
 public:
  /// `transforms` must outlive the synchroniser; it gives T_map_camera.
  TimeSynchronizer(const SynchronizerConfig& config, const TransformTree& transforms);

  enum class Stream { kDepth, kSegmentation, kColor, kCameraInfo, kPose };

  /// kStampBackwards, and nothing stored, when the stamp is not after the stream's newest one;
  /// kStampsRestarted: stored, and what the stream had at this stamp or later is dropped.
  std::optional<InputProblem> add_image(Stream stream, StampNs stamp_ns, cv::Mat image);
  /// Intrinsics with stamp 0 hold from now on, until others come.
  std::optional<InputProblem> add_camera_info(StampNs stamp_ns, const CameraModel& camera);
  /// Tells how far the pose stream has come, for the bounded wait; `problem` is what the transforms
  /// said of the pose.
  void pose_seen(StampNs stamp_ns, const std::optional<InputProblem>& problem);

  /// Of one stream, or of all; kBounded until something else is said.
  void set_patience(Stream stream, Patience patience) { patience_[stream] = patience; }
  void set_patience(Patience patience);

  /// Frame of the depth camera in the transforms, when only the first image tells.
  void set_camera_frame(const std::string& frame) { config_.camera_frame = frame; }

  /// Frames that are ready, by stamp.
  std::vector<SyncedFrame> take();
  /// The same, when nothing more will come: whatever a frame lacks is missing.
  std::vector<SyncedFrame> flush();

  /// The source has gone: the next one may start at any stamp. Nothing may be pending.
  void restart();

  std::size_t pending() const { return depth_.size(); }
  /// No frame with this stamp or an earlier one will come out any more.
  StampNs watermark_ns() const { return watermark_ns_; }
  /// Newest stamp of a stream of images or camera infos.
  std::optional<StampNs> newest_ns(Stream stream) const;
  /// The stream that the oldest frame waits for; nothing when there is none or it waits for none.
  std::optional<Stream> blocked_by() const { return blocked_by_; }
  /// When that is the pose: the transform that is not there yet, "parent -> child".
  const std::string& blocking_edge() const { return blocking_edge_; }
  /// What frames lacked that have come out, or were dropped, since the call before: the pose, or a
  /// mask although masks come. The first and the number of each kind.
  struct Lack {
    Stream stream;
    InputProblem problem;
    std::uint64_t times = 1;
  };
  std::vector<Lack> take_lacks() { return std::exchange(lacks_, {}); }
  /// "" or "waiting for <stream> since <stamp>" about the oldest frame that is not complete.
  std::string waiting_for() const;
  const SynchronizerCounts& counts() const { return counts_; }

 private:
  template <class T>
  using Queue = std::deque<std::pair<StampNs, T>>;
  /// What a frame takes of one stream of images.
  struct Choice {
    enum class State { kFound, kWait, kMissing } state = State::kMissing;
    StampNs stamp_ns = 0;  // of kFound
    cv::Mat image;
  };

  std::vector<SyncedFrame> run(bool last_call);
  bool settled(Stream stream, StampNs stamp_ns, bool last_call) const;
  bool passed(Stream stream, StampNs stamp_ns) const;
  Choice choose(Stream stream, StampNs stamp_ns, bool last_call);
  /// The image of the choice and those before it are used up.
  void use_up(Stream stream, const Choice& choice);
  bool camera_at(StampNs stamp_ns, bool settle, CameraModel& camera);
  /// False: it has to be waited for. The frame is dropped when `found` is false.
  bool pose_at(StampNs stamp_ns, bool last_call, Pose& T_W_C, bool& found);
  std::optional<InputProblem> judge(Stream stream, StampNs stamp_ns);
  void drop_beyond(Stream stream, StampNs stamp_ns);
  StampNs horizon_ns() const;
  bool wait_over(Stream stream, StampNs ahead_ns) const;
  Queue<cv::Mat>& images_of(Stream stream);
  void lacks(Stream stream, InputProblem problem);
  void lacks_mask(StampNs stamp_ns, bool used);

  SynchronizerConfig config_;
  const TransformTree& transforms_;
  Queue<cv::Mat> depth_, segmentation_, color_;
  Queue<CameraModel> infos_;
  std::optional<CameraModel> unstamped_info_;
  std::map<Stream, StampOrder> orders_;
  std::optional<StampNs> newest_pose_ns_;
  std::optional<StampNs> last_mask_ns_;  // the last one that is not kept any more
  StampNs watermark_ns_ = std::numeric_limits<StampNs>::min();
  std::map<Stream, Patience> patience_;
  std::optional<Stream> blocked_by_;
  std::string blocking_edge_;  // of the pose
  std::vector<Lack> lacks_;
  SynchronizerCounts counts_;
};

}  // namespace pocd

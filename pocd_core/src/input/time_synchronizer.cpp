#include "pocd/input/time_synchronizer.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

std::string stamp_text(StampNs stamp_ns) {
  const StampNs billion = 1'000'000'000;
  std::string nanoseconds = std::to_string(std::abs(stamp_ns % billion));
  return std::to_string(stamp_ns / billion) + "." + std::string(9 - nanoseconds.size(), '0') +
         nanoseconds;
}

const char* name_of(TimeSynchronizer::Stream stream) {
  switch (stream) {
    case TimeSynchronizer::Stream::kDepth:
      return "depth";
    case TimeSynchronizer::Stream::kSegmentation:
      return "segmentation";
    case TimeSynchronizer::Stream::kColor:
      return "color";
    case TimeSynchronizer::Stream::kCameraInfo:
      return "camera_info";
    case TimeSynchronizer::Stream::kPose:
      return "pose";
  }
  return "";
}

}  // namespace

TimeSynchronizer::TimeSynchronizer(const SynchronizerConfig& config,
                                   const TransformTree& transforms)
    : config_(config), transforms_(transforms) {
  POCD_CHECK(config.capacity > 0 && config.max_wait_ns >= 0 && config.tolerance_ns >= 0);
}

void TimeSynchronizer::set_patience(Patience patience) {
  for (const Stream stream : {Stream::kDepth, Stream::kSegmentation, Stream::kColor,
                              Stream::kCameraInfo, Stream::kPose}) {
    patience_[stream] = patience;
  }
}

bool TimeSynchronizer::wait_over(Stream stream, StampNs ahead_ns) const {
  const auto set = patience_.find(stream);
  switch (set == patience_.end() ? Patience::kBounded : set->second) {
    case Patience::kBounded:
      return ahead_ns > config_.max_wait_ns;
    case Patience::kEndless:
      return false;
    case Patience::kNone:
      return true;
  }
  return true;
}

std::optional<StampNs> TimeSynchronizer::newest_ns(Stream stream) const {
  const auto order = orders_.find(stream);
  return order == orders_.end() ? std::nullopt : order->second.newest_ns();
}

// How far the robot's data has come, whatever the stream.
StampNs TimeSynchronizer::horizon_ns() const {
  StampNs horizon_ns = newest_pose_ns_.value_or(std::numeric_limits<StampNs>::min());
  for (const auto& [stream, order] : orders_) {
    horizon_ns = std::max(horizon_ns, order.newest_ns().value_or(horizon_ns));
  }
  return horizon_ns;
}

std::optional<InputProblem> TimeSynchronizer::judge(Stream stream, StampNs stamp_ns) {
  StampOrder& order = orders_[stream];
  const StampNs before_ns = order.newest_ns().value_or(stamp_ns);
  const StampOrder::Verdict verdict = order.judge(stamp_ns);
  if (verdict == StampOrder::Verdict::kRestarted) drop_beyond(stream, stamp_ns);
  return stamp_problem(verdict, stamp_ns, before_ns);
}

void TimeSynchronizer::drop_beyond(Stream stream, StampNs stamp_ns) {
  const auto cut = [stamp_ns](auto& items) {
    const std::size_t before = items.size();
    while (!items.empty() && items.back().first >= stamp_ns) items.pop_back();
    return before - items.size();
  };
  if (stream == Stream::kDepth) {
    counts_.dropped_restart += cut(depth_);
    watermark_ns_ = std::min(watermark_ns_, stamp_ns - 1);
  } else if (stream == Stream::kCameraInfo) {
    cut(infos_);
  } else {
    counts_.unmatched_images += cut(stream == Stream::kSegmentation ? segmentation_ : color_);
  }
}

std::optional<InputProblem> TimeSynchronizer::add_image(Stream stream, StampNs stamp_ns,
                                                        cv::Mat image) {
  POCD_CHECK(stream != Stream::kCameraInfo && stream != Stream::kPose);
  auto problem = judge(stream, stamp_ns);
  if (stamp_refused(problem)) return problem;
  auto& images = stream == Stream::kDepth          ? depth_
                 : stream == Stream::kSegmentation ? segmentation_
                                                   : color_;
  images.emplace_back(stamp_ns, std::move(image));
  if (images.size() > config_.capacity) {
    if (stream == Stream::kDepth) {
      ++counts_.dropped_overflow;
      watermark_ns_ = images.front().first;
    } else {
      ++counts_.unmatched_images;
    }
    images.pop_front();
  }
  return problem;
}

std::optional<InputProblem> TimeSynchronizer::add_camera_info(StampNs stamp_ns,
                                                              const CameraModel& camera) {
  auto problem = judge(Stream::kCameraInfo, stamp_ns);
  if (stamp_refused(problem)) return problem;
  infos_.emplace_back(stamp_ns, camera);
  if (infos_.size() > config_.capacity) infos_.pop_front();
  return problem;
}

void TimeSynchronizer::pose_seen(StampNs stamp_ns, const std::optional<InputProblem>& problem) {
  if (problem && !used_anyway(*problem)) return;
  const bool restarted = problem && problem->reason == InputReason::kStampsRestarted;
  newest_pose_ns_ = restarted ? stamp_ns : std::max(newest_pose_ns_.value_or(stamp_ns), stamp_ns);
}

std::optional<cv::Mat> TimeSynchronizer::match(std::deque<std::pair<StampNs, cv::Mat>>& stream,
                                               StampNs stamp_ns) {
  while (!stream.empty() && stream.front().first < stamp_ns - config_.tolerance_ns) {
    ++counts_.unmatched_images;
    stream.pop_front();
  }
  if (stream.empty() || stream.front().first > stamp_ns + config_.tolerance_ns) return std::nullopt;
  return stream.front().second;
}

bool TimeSynchronizer::camera_at(StampNs stamp_ns, bool settle, CameraModel& camera) {
  // Intrinsics hardly ever change, so the one before will do once the wait is over.
  while (infos_.size() > 1 && infos_[1].first <= stamp_ns + config_.tolerance_ns) {
    infos_.pop_front();
  }
  if (infos_.empty() || infos_.front().first > stamp_ns + config_.tolerance_ns) return false;
  if (infos_.front().first < stamp_ns - config_.tolerance_ns && !settle) return false;
  camera = infos_.front().second;
  return true;
}

std::vector<SyncedFrame> TimeSynchronizer::run(bool last_call) {
  std::vector<SyncedFrame> frames;
  blocked_by_.reset();
  const StampNs newest_of_all_ns = horizon_ns();
  while (!depth_.empty()) {
    const StampNs stamp_ns = depth_.front().first;
    const auto settled = [&](Stream stream) {
      return last_call || wait_over(stream, newest_of_all_ns - stamp_ns);
    };
    SyncedFrame frame;
    frame.stamp_ns = stamp_ns;
    std::uint64_t* drop = nullptr;

    const auto passed = [&](Stream stream) {  // streams are in order: it will not come any more
      const std::optional<StampNs> newest = newest_ns(stream);
      return newest && *newest > stamp_ns + config_.tolerance_ns;
    };
    // True when the frame may go on as far as this stream is concerned.
    const auto fetch = [&](StreamUse use, Stream stream, auto& images, cv::Mat& out,
                           std::uint64_t& without, std::uint64_t& dropped) {
      if (use == StreamUse::kAbsent) return true;
      if (auto image = match(images, stamp_ns)) {
        out = std::move(*image);
        return true;
      }
      if (!settled(stream) && !passed(stream)) {
        blocked_by_ = stream;
        return false;
      }
      if (use == StreamUse::kRequired) {
        drop = &dropped;
      } else {
        ++without;
      }
      return true;
    };

    const bool camera_settled = settled(Stream::kCameraInfo) || passed(Stream::kCameraInfo);
    if (!camera_at(stamp_ns, camera_settled, frame.camera)) {
      if (!camera_settled) {
        blocked_by_ = Stream::kCameraInfo;
        break;
      }
      drop = &counts_.dropped_no_camera_info;
    }
    if (drop == nullptr) {
      const bool pose_settled = settled(Stream::kPose);
      const TransformLookup pose =
          transforms_.lookup(config_.map_frame, config_.camera_frame, stamp_ns,
                             pose_settled ? config_.extrapolation_ns : 0);
      if (pose.result == PoseLookup::kFound) {
        frame.T_W_C = pose.T_target_source;
      } else if (!pose_settled &&
                 (pose.result == PoseLookup::kTooNew || pose.result == PoseLookup::kEmpty)) {
        blocked_by_ = Stream::kPose;
        blocking_edge_ = pose.edge;
        break;
      } else {
        drop = &counts_.dropped_no_pose;
        // Images from before the first pose, and the last ones of a run, are nobody's mistake.
        if (!last_call && pose.result != PoseLookup::kTooOld) {
          pose_problem_ =
              transforms_.explain(config_.map_frame, config_.camera_frame, stamp_ns, pose);
        }
      }
    }
    const SynchronizerCounts before = counts_;
    if (drop == nullptr &&
        !(fetch(config_.segmentation, Stream::kSegmentation, segmentation_, frame.labels,
                counts_.without_segmentation, counts_.dropped_no_segmentation) &&
          fetch(config_.color, Stream::kColor, color_, frame.color, counts_.without_color,
                counts_.dropped_no_color))) {
      // A frame that still waits for colour has not gone on without segmentation yet.
      counts_.without_segmentation = before.without_segmentation;
      break;
    }
    frame.depth = std::move(depth_.front().second);
    depth_.pop_front();
    watermark_ns_ = stamp_ns;
    if (drop != nullptr) {
      ++*drop;
    } else {
      ++counts_.complete;
      frames.push_back(std::move(frame));
    }
  }
  return frames;
}

void TimeSynchronizer::restart() {
  POCD_CHECK(depth_.empty());
  counts_.unmatched_images += segmentation_.size() + color_.size();
  segmentation_.clear();
  color_.clear();
  infos_.clear();
  orders_.clear();
  newest_pose_ns_.reset();
  watermark_ns_ = std::numeric_limits<StampNs>::min();
}

std::vector<SyncedFrame> TimeSynchronizer::take() { return run(false); }
std::vector<SyncedFrame> TimeSynchronizer::flush() { return run(true); }

std::string TimeSynchronizer::waiting_for() const {
  if (depth_.empty()) return "";
  std::string stream = blocked_by_ ? name_of(*blocked_by_) : "its turn";
  if (blocked_by_ == Stream::kPose) stream += " (" + blocking_edge_ + ")";
  return "waiting for " + stream + " since " + stamp_text(depth_.front().first);
}

}  // namespace pocd

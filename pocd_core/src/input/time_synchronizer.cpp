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

bool TimeSynchronizer::add_image(Stream stream, StampNs stamp_ns, cv::Mat image) {
  const auto newest = newest_ns_.find(stream);
  if (newest != newest_ns_.end() && stamp_ns <= newest->second) return false;
  newest_ns_[stream] = stamp_ns;
  horizon_ns_ = std::max(horizon_ns_, stamp_ns);
  POCD_CHECK(stream != Stream::kCameraInfo && stream != Stream::kPose);
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
  return true;
}

bool TimeSynchronizer::add_camera_info(StampNs stamp_ns, const CameraModel& camera) {
  const auto newest = newest_ns_.find(Stream::kCameraInfo);
  if (newest != newest_ns_.end() && stamp_ns <= newest->second) return false;
  newest_ns_[Stream::kCameraInfo] = stamp_ns;
  horizon_ns_ = std::max(horizon_ns_, stamp_ns);
  infos_.emplace_back(stamp_ns, camera);
  if (infos_.size() > config_.capacity) infos_.pop_front();
  return true;
}

void TimeSynchronizer::pose_seen(StampNs stamp_ns) {
  horizon_ns_ = std::max(horizon_ns_, stamp_ns);
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
  while (!depth_.empty()) {
    const StampNs stamp_ns = depth_.front().first;
    const bool late = !patient_ && horizon_ns_ - stamp_ns > config_.max_wait_ns;
    const bool settle = last_call || late;
    SyncedFrame frame;
    frame.stamp_ns = stamp_ns;
    std::uint64_t* drop = nullptr;

    const auto passed = [&](Stream stream) {  // streams are in order: it will not come any more
      const auto newest = newest_ns_.find(stream);
      return newest != newest_ns_.end() && newest->second > stamp_ns + config_.tolerance_ns;
    };
    // True when the frame may go on as far as this stream is concerned.
    const auto fetch = [&](StreamUse use, Stream stream, auto& images, cv::Mat& out,
                           std::uint64_t& without, std::uint64_t& dropped) {
      if (use == StreamUse::kAbsent) return true;
      if (auto image = match(images, stamp_ns)) {
        out = std::move(*image);
        return true;
      }
      if (!settle && !passed(stream) && missing_ != stream) {
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

    if (!camera_at(stamp_ns, settle || passed(Stream::kCameraInfo), frame.camera)) {
      if (!settle && !passed(Stream::kCameraInfo)) {
        blocked_by_ = Stream::kCameraInfo;
        break;
      }
      drop = &counts_.dropped_no_camera_info;
    }
    if (drop == nullptr) {
      const TransformLookup pose = transforms_.lookup(
          config_.map_frame, config_.camera_frame, stamp_ns, settle ? config_.extrapolation_ns : 0);
      if (pose.result == PoseLookup::kFound) {
        frame.T_W_C = pose.T_target_source;
      } else if (!settle &&
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
  newest_ns_.clear();
  horizon_ns_ = watermark_ns_ = std::numeric_limits<StampNs>::min();
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

#include "pocd/input/time_synchronizer.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <string>
#include <utility>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// Images from before the first pose, and the last ones of a run, are nobody's mistake; those
// further off are.
constexpr StampNs kNobodysMistake = 1'000'000'000;

std::string stamp_text(StampNs stamp_ns) {
  const StampNs billion = 1'000'000'000;
  std::string nanoseconds = std::to_string(std::abs(stamp_ns % billion));
  return std::to_string(stamp_ns / billion) + "." + std::string(9 - nanoseconds.size(), '0') +
         nanoseconds;
}

std::string milliseconds(StampNs ns) {
  char text[40];
  std::snprintf(text, sizeof text, "%.1f ms", static_cast<double>(ns) * 1e-6);
  return text;
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
    counts_.unmatched_images += cut(images_of(stream));
  }
}

TimeSynchronizer::Queue<cv::Mat>& TimeSynchronizer::images_of(Stream stream) {
  return stream == Stream::kSegmentation ? segmentation_ : color_;
}

std::optional<InputProblem> TimeSynchronizer::add_image(Stream stream, StampNs stamp_ns,
                                                        cv::Mat image) {
  POCD_CHECK(stream != Stream::kCameraInfo && stream != Stream::kPose);
  auto problem = judge(stream, stamp_ns);
  if (stamp_refused(problem)) return problem;
  if (stream == Stream::kDepth) {
    depth_.emplace_back(stamp_ns, std::move(image));
    if (depth_.size() <= 2 * config_.capacity) return problem;  // run() comes first
    ++counts_.dropped_overflow;
    watermark_ns_ = depth_.front().first;
    depth_.pop_front();
    return problem;
  }
  Queue<cv::Mat>& images = images_of(stream);
  images.emplace_back(stamp_ns, std::move(image));
  if (images.size() <= config_.capacity) return problem;
  ++counts_.unmatched_images;
  if (stream == Stream::kSegmentation) last_mask_ns_ = images.front().first;
  images.pop_front();
  return problem;
}

std::optional<InputProblem> TimeSynchronizer::add_camera_info(StampNs stamp_ns,
                                                              const CameraModel& camera) {
  if (stamp_ns == 0) {
    unstamped_info_ = camera;
    return std::nullopt;
  }
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

bool TimeSynchronizer::settled(Stream stream, StampNs stamp_ns, bool last_call) const {
  return last_call || depth_.size() >= config_.capacity ||
         wait_over(stream, horizon_ns() - stamp_ns);
}

// Streams are in order: what belongs to the stamp will not come any more.
bool TimeSynchronizer::passed(Stream stream, StampNs stamp_ns) const {
  const std::optional<StampNs> newest = newest_ns(stream);
  return newest && *newest > stamp_ns + config_.tolerance_ns;
}

TimeSynchronizer::Choice TimeSynchronizer::choose(Stream stream, StampNs stamp_ns, bool last_call) {
  Queue<cv::Mat>& images = images_of(stream);
  while (!images.empty() && images.front().first < stamp_ns - config_.tolerance_ns) {
    if (stream == Stream::kSegmentation) last_mask_ns_ = images.front().first;
    ++counts_.unmatched_images;
    images.pop_front();
  }
  const auto off = [&](StampNs other_ns) { return std::abs(other_ns - stamp_ns); };
  auto nearest = images.end();
  for (auto it = images.begin(); it != images.end(); ++it) {
    if (off(it->first) > config_.tolerance_ns) break;
    if (nearest == images.end() || off(it->first) < off(nearest->first)) nearest = it;
  }
  const bool wait_over = settled(stream, stamp_ns, last_call);
  const std::optional<StampNs> newest = newest_ns(stream);
  if (nearest != images.end()) {
    // A nearer one may come, unless this one is exact or later ones have come already.
    const bool final = nearest->first == stamp_ns || (newest && *newest > stamp_ns) || wait_over;
    if (!final) return {Choice::State::kWait, 0, {}};
    // It may be the next depth image's own.
    const bool of_next =
        depth_.size() > 1 && std::abs(nearest->first - depth_[1].first) < off(nearest->first);
    if (!of_next) return {Choice::State::kFound, nearest->first, nearest->second};
  } else if (!wait_over && !passed(stream, stamp_ns)) {
    return {Choice::State::kWait, 0, {}};
  }
  return {};
}

void TimeSynchronizer::use_up(Stream stream, const Choice& choice) {
  if (choice.state != Choice::State::kFound) return;
  Queue<cv::Mat>& images = images_of(stream);
  for (; images.front().first < choice.stamp_ns; images.pop_front()) ++counts_.unmatched_images;
  images.pop_front();
  if (stream == Stream::kSegmentation) last_mask_ns_ = choice.stamp_ns;
}

bool TimeSynchronizer::camera_at(StampNs stamp_ns, bool settle, CameraModel& camera) {
  // Intrinsics hardly ever change, so the one before, or else the first, will do once the wait is
  // over.
  while (infos_.size() > 1 && infos_[1].first <= stamp_ns + config_.tolerance_ns) {
    infos_.pop_front();
  }
  if (infos_.empty()) {
    if (unstamped_info_) camera = *unstamped_info_;
    return unstamped_info_.has_value();
  }
  const bool own = std::abs(infos_.front().first - stamp_ns) <= config_.tolerance_ns;
  if (!own && !settle) return false;
  camera = infos_.front().second;
  return true;
}

void TimeSynchronizer::lacks(Stream stream, InputProblem problem) {
  for (Lack& known : lacks_) {
    if (known.stream != stream || known.problem.reason != problem.reason) continue;
    ++known.times;
    return;
  }
  lacks_.push_back({stream, std::move(problem)});
}

void TimeSynchronizer::lacks_mask(StampNs stamp_ns, bool used) {
  std::optional<StampNs> nearest = last_mask_ns_;
  if (!segmentation_.empty()) {
    const StampNs later = segmentation_.front().first;
    if (!nearest || std::abs(later - stamp_ns) < std::abs(*nearest - stamp_ns)) nearest = later;
  }
  if (!nearest) return;  // no mask has come yet: the robot may have none
  const StampNs off = *nearest - stamp_ns;
  lacks(Stream::kSegmentation,
        {InputReason::kNoMask,
         "the depth image of " + stamp_text(stamp_ns) + " has no mask within " +
             milliseconds(config_.tolerance_ns) + ", the nearest is " +
             milliseconds(std::abs(off)) + (off < 0 ? " earlier" : " later") +
             (used ? ": the frame goes on without mask" : ": the frame is not used")});
}

bool TimeSynchronizer::pose_at(StampNs stamp_ns, bool last_call, Pose& T_W_C, bool& found) {
  const bool is_settled = settled(Stream::kPose, stamp_ns, last_call);
  const TransformLookup pose = transforms_.lookup(config_.map_frame, config_.camera_frame, stamp_ns,
                                                  is_settled ? config_.extrapolation_ns : 0);
  found = pose.result == PoseLookup::kFound;
  if (found) {
    T_W_C = pose.T_target_source;
    return true;
  }
  const bool too_new = pose.result == PoseLookup::kTooNew;
  if (!is_settled && (too_new || pose.result == PoseLookup::kEmpty)) {
    blocked_by_ = Stream::kPose;
    blocking_edge_ = pose.edge;
    return false;
  }
  ++counts_.dropped_no_pose;
  const bool excused = pose.result == PoseLookup::kTooOld ? pose.off_ns <= kNobodysMistake
                       : too_new ? last_call && pose.off_ns <= kNobodysMistake
                                 : last_call && counts_.complete > 0;
  if (!excused) {
    lacks(Stream::kPose,
          transforms_.explain(config_.map_frame, config_.camera_frame, stamp_ns, pose));
  }
  return true;
}

std::vector<SyncedFrame> TimeSynchronizer::run(bool last_call) {
  std::vector<SyncedFrame> frames;
  blocked_by_.reset();
  while (!depth_.empty()) {
    const StampNs stamp_ns = depth_.front().first;
    SyncedFrame frame;
    frame.stamp_ns = stamp_ns;
    bool used = true;
    const bool camera_settled =
        settled(Stream::kCameraInfo, stamp_ns, last_call) || passed(Stream::kCameraInfo, stamp_ns);
    if (!camera_at(stamp_ns, camera_settled, frame.camera)) {
      if (!camera_settled) {
        blocked_by_ = Stream::kCameraInfo;
        break;
      }
      ++counts_.dropped_no_camera_info;
      used = false;
    }
    if (used && !pose_at(stamp_ns, last_call, frame.T_W_C, used)) break;
    Choice labels, color;
    const auto waits = [&](StreamUse use, Stream stream, Choice& choice) {
      if (!used || use == StreamUse::kAbsent) return false;
      choice = choose(stream, stamp_ns, last_call);
      if (choice.state == Choice::State::kWait) blocked_by_ = stream;
      return choice.state == Choice::State::kWait;
    };
    if (waits(config_.segmentation, Stream::kSegmentation, labels) ||
        waits(config_.color, Stream::kColor, color)) {
      break;
    }
    if (used && config_.segmentation != StreamUse::kAbsent && labels.image.empty()) {
      used = config_.segmentation == StreamUse::kOptional;
      ++(used ? counts_.without_segmentation : counts_.dropped_no_segmentation);
      lacks_mask(stamp_ns, used);
    }
    if (used && config_.color != StreamUse::kAbsent && color.image.empty()) {
      used = config_.color == StreamUse::kOptional;
      ++(used ? counts_.without_color : counts_.dropped_no_color);
    }
    use_up(Stream::kSegmentation, labels);
    use_up(Stream::kColor, color);
    frame.depth = std::move(depth_.front().second);
    frame.labels = labels.image;
    frame.color = color.image;
    depth_.pop_front();
    watermark_ns_ = stamp_ns;
    if (!used) continue;
    ++counts_.complete;
    frames.push_back(std::move(frame));
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
  unstamped_info_.reset();
  last_mask_ns_.reset();
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

#include "pocd_dds/node/robot_input.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"
#include "pocd_dds/node/input_delivery.hpp"

namespace pocd::dds {
namespace {

// Taken in one turn, so that a topic which never stops coming does not hold up the others. More
// messages than their readers keep.
constexpr std::size_t kMostImages = 16;
constexpr int kMostMessages = 1000;
// Depth images that wait for something; the synchroniser would drop beyond twice as many.
constexpr std::size_t kHoldDepth = 32;

constexpr std::string_view kArrow = " -> ";  // between the two frames of a transform

double seconds(RobotInput::Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

std::string whole_seconds(double seconds) {
  return std::to_string(static_cast<long>(seconds)) + " s";
}

eprosima::fastdds::dds::TypeSupport image_type(const std::string& topic) {
  using eprosima::fastdds::dds::TypeSupport;
  return is_compressed_name(topic) ? TypeSupport(new GuardedType<CompressedImageVisitType>())
                                   : TypeSupport(new GuardedType<ImageVisitType>());
}

}  // namespace

ImageReader::ImageReader(const std::shared_ptr<Participant>& participant, InputStream stream,
                         const std::string& topic, bool lossless, Wakeup& wakeup)
    : RawReader(participant, spec_of(stream, topic), topic, image_type(topic),
                input_delivery(spec_of(stream, topic), lossless), wakeup) {}

RobotInput::RobotInput(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
                       const RobotConfig& robot, const StreamContext& context,
                       ProblemCounter& problems, Wakeup& wakeup, LatencyLog& latency)
    : lossless_(node.lossless),
      silent_wait_s_(node.silent_wait_s),
      problems_(problems),
      wakeup_(wakeup),
      latency_(latency),
      streams_(robot, context),
      segmentation_required_(node.segmentation == StreamUse::kRequired),
      color_required_(node.color == StreamUse::kRequired),
      tf_(has_own_tf(node, robot)
              ? std::make_unique<TransformInput>(participant, streams_.topic(InputStream::kTf),
                                                 streams_.topic(InputStream::kTfStatic),
                                                 input_delivery(topics::kTf, node), wakeup)
              : nullptr),
      odometry_(participant, topics::kOdometry, streams_.topic(InputStream::kOdometry),
                input_delivery(topics::kOdometry, node), wakeup),
      camera_info_(participant, topics::kCameraInfo, streams_.topic(InputStream::kCameraInfo),
                   input_delivery(topics::kCameraInfo, node), wakeup) {
  const auto image_reader = [&](InputStream stream) {
    return std::make_unique<ImageReader>(participant, stream, streams_.topic(stream), node.lossless,
                                         wakeup);
  };
  if (node.segmentation != StreamUse::kAbsent)
    segmentation_ = image_reader(InputStream::kSegmentation);
  if (node.color != StreamUse::kAbsent) color_ = image_reader(InputStream::kColor);
  depth_ = image_reader(InputStream::kDepth);
}

void RobotInput::look(Turn turn) {
  turn_ = turn;
  const bool live_before = live();
  if (live_before && !had_source_) heard(Stream::kDepth);  // silence begins now
  had_source_ = had_source_ || live_before;
  source_left_ = had_source_ && !live_before && turn != Turn::kHold;
}

void RobotInput::drain(const std::set<std::string>& shared_moved) {
  hear_transforms(shared_moved);
  drain_poses();
  drain_camera_info();
  for (ImageReader* reader : {depth_.get(), segmentation_.get(), color_.get()}) {
    if (reader != nullptr) problems_.count_incompatible(*reader);
  }
  if (turn_ == Turn::kHold) return;
  if (segmentation_) drain_images(Stream::kSegmentation, *segmentation_);
  if (color_) drain_images(Stream::kColor, *color_);
  drain_images(Stream::kDepth, *depth_);
}

void RobotInput::drain_camera_info() {
  problems_.count_incompatible(camera_info_);
  camera_info_.take_some(kMostMessages, [&](const auto& info, const SampleMeta& meta) {
    if (!meta.valid) return;
    heard(Stream::kCameraInfo);
    streams_.add_camera_info(to_stamp(info.header().stamp()), camera_from(info));
  });
  problems_.count_damaged(camera_info_);
}

void RobotInput::drain_poses() {
  problems_.count_incompatible(odometry_);
  if (tf_) hear_transforms(tf_->drain(streams_.own_transforms(), problems_));
  odometry_.take_some(kMostMessages, [&](const auto& message, const SampleMeta& meta) {
    if (meta.valid && streams_.add_odometry(transform_from(message))) heard(Stream::kPose);
  });
  problems_.count_damaged(odometry_);
}

// Others send transforms, too: what counts is the one that the oldest frame waits for.
void RobotInput::hear_transforms(const std::set<std::string>& moved) {
  if (streams_.synchronizer().blocked_by() != Stream::kPose) return;
  const std::string& edge = streams_.synchronizer().blocking_edge();
  const std::size_t arrow = edge.find(kArrow);
  if (arrow != std::string::npos && moved.count(edge.substr(arrow + kArrow.size())) > 0) {
    heard(Stream::kPose);
  }
}

void RobotInput::drain_images(Stream stream, ImageReader& reader) {
  std::optional<StampNs> taken_ns;  // of an image that goes on to a frame
  ImageVisit visit{[&](const recording::RosImage& message) {
    const recording::RosHeader& header = message.header;
    taken_ns.reset();
    if (streams_.add_image(stream, header.stamp_ns, header.frame_id, view_of(message))) {
      taken_ns = header.stamp_ns;
    }
  }};
  SampleMeta meta;
  count_lost(stream, reader);
  // At the end all that the reader holds now is wanted, but not what a writer that is still there
  // goes on to send.
  const std::size_t most = ending() ? std::max(kMostImages, reader.unread()) : kMostImages;
  for (std::size_t i = 0; i < most; ++i) {
    const bool enough = stream == Stream::kDepth && streams_.synchronizer().pending() >= kHoldDepth;
    if (lossless_ && enough && !ending()) return;
    const double before_ms = thread_cpu_ms();
    const bool taken = reader.take(visit, meta);
    take_cpu_ms_ += thread_cpu_ms() - before_ms;
    visit.rethrow();
    problems_.count_damaged(reader);
    if (!taken) return;
    if (!meta.valid) continue;
    heard(stream);
    images_ += stream == Stream::kDepth;
    if (taken_ns) latency_.received(name(), *taken_ns, meta.received_ns);
  }
  wakeup_.wake();
}

void RobotInput::count_lost(Stream stream, const ImageReader& reader) {
  std::uint64_t& told = told_lost_[stream];
  const std::uint64_t lost = reader.lost();
  problems_.count(
      reader.topic(), "images_lost",
      "images did not arrive whole, or found no room: net.core.rmem_max, the buffers in "
      "the profile, a busy machine",
      lost - told);
  told = lost;
}

void RobotInput::heard(Stream stream) {
  heard_[stream] = Clock::now();
  if (given_up_ == stream) given_up_.reset();
}

// Without loss, a frame is waited for as long as its streams have a source. One that is announced
// but says nothing, while the sender of the depth images is held back, must not hold it for ever.
void RobotInput::judge_silence() {
  const std::optional<Stream> blocker = streams_.synchronizer().blocked_by();
  const auto now = Clock::now();
  if (!blocker || streams_.synchronizer().pending() < kHoldDepth) {
    moved_on_ = now;
    return;
  }
  const auto since = std::max(moved_on_, heard_[*blocker]);
  if (!lossless_ || given_up_ || seconds(now - since) < silent_wait_s_) return;
  given_up_ = blocker;
  problems_.count(
      streams_.topic(*blocker),
      {InputReason::kSilentStream,
       "nothing came for " + whole_seconds(silent_wait_s_) + " while " +
           std::to_string(streams_.synchronizer().pending()) + " depth images of " + name() +
           " were " + streams_.synchronizer().waiting_for() + ": not waited for until it comes"});
}

double RobotInput::silent_s() const {
  const auto last = heard_.find(Stream::kDepth);
  return live() && last != heard_.end() ? seconds(Clock::now() - last->second) : 0.0;
}

std::string RobotInput::waiting_for() const {
  if (given_up_) return "going on without " + streams_.topic(*given_up_) + ", which is silent";
  return streams_.synchronizer().waiting_for();
}

void RobotInput::set_patience() {
  const bool endless = lossless_ && given_up_ != Stream::kPose;
  streams_.synchronizer().set_patience(endless ? Patience::kEndless : Patience::kBounded);
  if (!endless) return;
  // Intrinsics hold until others come.
  if (given_up_ == Stream::kCameraInfo) {
    streams_.synchronizer().set_patience(Stream::kCameraInfo, Patience::kNone);
  }
  // What nobody announces does not come.
  const auto of_images = [&](Stream stream, const ImageReader* reader, bool required) {
    if (reader == nullptr) return;
    if (given_up_ == stream) {
      streams_.synchronizer().set_patience(stream, Patience::kNone);
    } else if (!required && reader->matched() == 0) {
      streams_.synchronizer().set_patience(stream, Patience::kBounded);
    }
  };
  of_images(Stream::kSegmentation, segmentation_.get(), segmentation_required_);
  of_images(Stream::kColor, color_.get(), color_required_);
}

std::vector<Frame> RobotInput::take() {
  judge_silence();
  set_patience();
  std::vector<Frame> frames = streams_.take(ending());
  if (!frames.empty()) {
    moved_on_ = Clock::now();
    if (given_up_ == Stream::kPose) given_up_.reset();  // every frame has one
  }
  return frames;
}

std::optional<std::vector<std::string>> RobotInput::settle_departure() {
  if (!source_left_) return std::nullopt;
  had_source_ = source_left_ = false;
  heard_.clear();
  given_up_.reset();
  return streams_.restart();
}

std::uint64_t RobotInput::lost() const {
  return depth_->lost() + (segmentation_ ? segmentation_->lost() : 0);
}

}  // namespace pocd::dds

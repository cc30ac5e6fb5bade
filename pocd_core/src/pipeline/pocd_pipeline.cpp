#include "pocd/pipeline/pocd_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>

#include "../track/object_tracker.hpp"
#include "archive_access.hpp"
#include "frame_clock.hpp"
#include "ignored_regions.hpp"
#include "looked_at.hpp"
#include "operator_acts.hpp"
#include "pipeline_archive.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/check_parameters.hpp"
#include "pocd/common/cpu_time.hpp"
#include "pocd/segmentation/things.hpp"
#include "robot_notes.hpp"

namespace pocd {
namespace {

/// Time per stage, for reports only: a system call or two per stage.
class StageClock {
 public:
  StageClock(const ThreadPool& pool, std::vector<StageTiming>& timings)
      : pool_(pool), timings_(timings), wall_(wall_ms()), cpu_(cpu_ms()) {}
  void done(const char* stage) {
    const double wall = wall_ms(), cpu = cpu_ms();
    timings_.push_back({stage, wall - wall_, cpu - cpu_});
    wall_ = wall, cpu_ = cpu;
  }

 private:
  static double wall_ms() { return clock_ms(CLOCK_MONOTONIC); }
  /// This thread and the pool's, not the process: that has other work, too.
  double cpu_ms() const { return thread_cpu_ms() + pool_.worker_cpu_ms(); }

  const ThreadPool& pool_;
  std::vector<StageTiming>& timings_;
  double wall_, cpu_;
};

std::string off_text(const Frame& frame, StampNs newest_ns) {
  const double ahead_s =
      (static_cast<double>(frame.stamp_ns) - static_cast<double>(newest_ns)) * 1e-9;
  char text[80];
  std::snprintf(text, sizeof(text), "stamp is %.1f s %s the newest", std::abs(ahead_s),
                ahead_s > 0.0 ? "ahead of" : "behind");
  return (frame.robot.empty() ? "" : frame.robot + ": ") + text;
}

std::string masks_ended_text(const Frame& frame, const ClassMap& classes) {
  const auto seconds = MaskWatch::kEnded / 1'000'000'000;
  return (frame.robot.empty() ? "" : frame.robot + ": ") + "no segmentation image for " +
         std::to_string(seconds) + " s: goes on without, " +
         (classes.without_masks == WithoutMasks::kThings
              ? "with things by geometry"
              : "all pixels are of class " +
                    classes.name(static_cast<ClassId>(classes.default_class)));
}

}  // namespace

struct PocdPipeline::Impl {
  explicit Impl(const PipelineConfig& c)
      : config(c),
        classes(c.classes),
        pool(c.threads),
        pose_gate(c.pose_gate),
        tracker(TrackerConfig{c.depth_noise, c.classes, c.segmentation, c.association, c.change,
                              c.state, c.map}),
        map(c.map),
        looked_at(c.map.voxel_size_m) {}

  PipelineConfig config;
  ClassTable classes;
  ThreadPool pool;
  FrameClock frame_clock;
  PoseGate pose_gate;
  Grounds grounds;
  ObjectTracker tracker;
  TsdfMap map;
  MaskWatch masks;
  IgnoredRegions ignored;
  LookedAt looked_at;
  // Memory of a frame, kept between frames.
  OrganizedCloud cloud;
  PlaneSegmentation planes;
  Observations observations;
  DepthField field;
  std::vector<std::uint32_t> owner_of_pixel;  ///< of observations
  bool mask_missing = false;
  PipelineArchive archive;

  PipelineParts parts() {
    // All members: one that is added does not compile until it was decided whether it is kept.
    [[maybe_unused]] auto& [config_, classes_, pool_, frame_clock_, pose_gate_, grounds_, tracker_,
                            map_, masks_, ignored_regions_, looked_at_, cloud_, planes_,
                            observations_, field_, owner_of_pixel_, mask_missing_, archive_] =
        *this;
    return {frame_clock_, pose_gate_, grounds_, masks_, ignored_regions_, looked_at_, tracker_};
  }

  /// Before anything changes: a frame that is refused later would leave half of its traces.
  void check(const Frame& frame) const;
  void skip_what_moves();
  void integrate(const Frame& frame);
};

PocdPipeline::PocdPipeline(const PipelineConfig& config) {
  check_parameters(config, "configuration of the pipeline");
  impl_ = std::make_unique<Impl>(config);
}
PocdPipeline::~PocdPipeline() = default;

FrameResult PocdPipeline::process_frame(const Frame& frame) {
  Impl& p = *impl_;
  p.check(frame);
  FrameResult result;
  const StampNs newest_ns = p.frame_clock.newest_ns();
  const FrameClock::Verdict verdict = p.frame_clock.judge(frame.robot, frame.stamp_ns);
  if (verdict != FrameClock::Verdict::kGoesOn) {
    result.accepted = verdict == FrameClock::Verdict::kSetBack;
    result.warnings.push_back(off_text(frame, newest_ns) + (result.accepted
                                                                ? ": clocks were set back, goes on"
                                                                : ": frame not used"));
    if (!result.accepted) return result;
    p.tracker.set_clock_back(newest_ns, frame.stamp_ns);
  }
  const auto refused = p.pose_gate.refuse(frame);
  if (const auto robot = p.pose_gate.take_forgotten()) {
    p.grounds.forget(*robot);
    p.masks.forget(*robot);
    result.warnings.push_back("more than " + std::to_string(PoseGate::kMostRobots) +
                              " names of robots: " + (robot->empty() ? "\"\"" : *robot) +
                              ", heard of longest ago, would be a new robot");
  }
  if (refused) {
    result.accepted = false;
    result.warnings.push_back(*refused + ": frame not used");
    return result;
  }
  StageClock clock(p.pool, result.timings);
  const auto& segmentation = p.config.segmentation;
  const auto& noise = p.config.depth_noise;

  organize(frame, segmentation.stride, p.config.map.max_depth_m, p.config.classes, p.classes,
           p.pool, p.cloud);
  const MaskWatch::Masks masks = p.masks.judge(frame.robot, frame.stamp_ns, !frame.labels.empty());
  p.mask_missing = masks == MaskWatch::Masks::kMissing;
  if (masks == MaskWatch::Masks::kEnd)
    result.warnings.push_back(masks_ended_text(frame, p.config.classes));
  const bool without = masks == MaskWatch::Masks::kNone || masks == MaskWatch::Masks::kEnd;
  if (without && p.config.classes.without_masks == WithoutMasks::kThings) take_for_things(p.cloud);
  p.ignored.mark(p.config.map.max_depth_m, p.pool, p.cloud);
  clock.done("organize");
  Frame placed = frame;  // images are shared, not copied
  if (p.config.pose_refinement.enabled) {
    const auto T_W_W = refine_pose(p.cloud, p.tracker.library(), p.config.map.max_depth_m, noise,
                                   p.config.pose_refinement);
    if (T_W_W) apply_correction(*T_W_W, p.cloud);
    placed.T_W_C = p.cloud.T_W_C;
  }
  clock.done("pose");
  segment_planes(p.cloud, segmentation, noise, p.planes);
  vote_planes(p.planes, segmentation.majority_share, p.cloud);
  GroundModel& ground = p.grounds.of(frame.robot);
  ground.update(p.planes, segmentation, noise, p.cloud);
  clock.done("clean");
  if (p.mask_missing) {
    // What things are would be a guess: they may be seen to be gone, but nothing is learnt of them.
    p.observations.list.clear();
    p.observations.observation_of.assign(p.cloud.size(), Observations::kNone);
    result.warnings.push_back((frame.robot.empty() ? "" : frame.robot + ": ") +
                              "no segmentation image: nothing is added, matched or mapped");
  } else {
    extract_observations(segmentation, noise, p.config.map.voxel_size_m, p.planes, p.cloud,
                         p.observations);
  }
  clock.done("cluster");
  p.looked_at.note(p.cloud, frame.stamp_ns);
  p.field.update(p.cloud);
  MapEdits edits;
  const auto distance_at = [&](const Eigen::Vector3f& point_W) {
    return p.map.distance_at(point_W, FreeSpace::kLooks, edits);
  };
  p.tracker.update(frame, p.cloud, p.field, p.observations, ground, distance_at, edits,
                   p.owner_of_pixel, result);
  clock.done("objects");
  edits.apply_to(p.map);
  p.integrate(placed);
  if (const auto problem = p.map.take_problem()) result.warnings.push_back(*problem);
  clock.done("map");
  return result;
}

void PocdPipeline::Impl::check(const Frame& frame) const {
  const std::string source =
      (frame.robot.empty() ? "" : frame.robot + ": ") + "frame " + std::to_string(frame.sequence);
  validate_frame(frame, source);
  const int stride = config.segmentation.stride;
  if (frame.camera.width < stride || frame.camera.height < stride) {
    throw InputError(source + ": image is " + std::to_string(frame.camera.width) + "x" +
                     std::to_string(frame.camera.height) +
                     ", smaller than segmentation.stride = " + std::to_string(stride));
  }
  map.check_view(frame);
}

void PocdPipeline::Impl::skip_what_moves() {
  constexpr std::size_t kGrain = 8192;
  pool.parallel_for(cloud.size(), kGrain, [this](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (mask_missing || cloud.kind[i] == PixelKind::kDynamic ||
          cloud.kind[i] == PixelKind::kIgnore) {
        owner_of_pixel[i] = IntegrationInput::kSkip;
      }
    }
  });
}

void PocdPipeline::Impl::integrate(const Frame& frame) {
  skip_what_moves();
  IntegrationInput input;
  input.frame = &frame;
  input.owners = owner_of_pixel.data();
  input.owner_width = cloud.width;
  input.owner_height = cloud.height;
  input.owner_stride = cloud.stride;
  map.integrate(input, pool);
}

std::vector<ObjectSnapshot> PocdPipeline::objects() const {
  std::vector<ObjectSnapshot> list;
  for (const auto& [id, object] : impl_->tracker.library().all()) {
    if (object->confirmed) list.push_back(snapshot(*object));
  }
  return list;
}

std::uint64_t PocdPipeline::object_visits() const { return impl_->tracker.library().visits(); }

void PocdPipeline::note_looks() { impl_->looked_at.start(); }
std::vector<RegionLook> PocdPipeline::take_looks() { return impl_->looked_at.take(); }
std::vector<RegionLook> PocdPipeline::looks() const { return impl_->looked_at.all(); }

WordOutcome PocdPipeline::apply(const OperatorWord& word) {
  Impl& p = *impl_;
  return follow(word, {p.frame_clock.newest_ns(), p.tracker, p.map, p.grounds, p.ignored});
}

std::vector<Piece> PocdPipeline::take_changed_pieces() {
  return impl_->archive.take_changed(impl_->parts());
}

void PocdPipeline::restore(const std::vector<Piece>& pieces) {
  impl_->archive.restore(impl_->parts(), pieces, impl_->config.map.voxel_size_m);
}

PocdPipeline::Numbers PocdPipeline::numbers() const {
  return {ArchiveAccess::next_id(impl_->tracker), ArchiveAccess::next_event(impl_->tracker)};
}

void PocdPipeline::skip_to(const Numbers& numbers) {
  std::uint32_t& object = ArchiveAccess::next_id(impl_->tracker);
  std::uint64_t& event = ArchiveAccess::next_event(impl_->tracker);
  object = std::max(object, numbers.object);
  event = std::max(event, numbers.event);
}

TsdfMap& PocdPipeline::map() { return impl_->map; }
const TsdfMap& PocdPipeline::map() const { return impl_->map; }

}  // namespace pocd

#include "pocd/eval/evaluation.hpp"

#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"

namespace pocd {
namespace {

/// Measured depth within this of a voxel's own still is that voxel: two voxels of the map.
constexpr double kSeenMargin_voxels = 2.0;
/// Measured frames that are added to the observed region of a recording.
constexpr int kRegionStride = 3;

/// A method on the whole route, and on the last visit alone.
struct Contestant {
  std::unique_ptr<MappingMethod> route, alone;
  MethodScore score;
  RunEvents run;
  double cpu_total_ms = 0.0;
};

std::size_t visit_of(std::uint64_t sequence, const std::vector<std::uint64_t>& begin) {
  std::size_t visit = 0;
  while (visit + 1 < begin.size() && sequence >= begin[visit + 1]) ++visit;
  return visit;
}

std::vector<std::vector<OrientedBox>> places_until(const SceneTruth& truth, std::size_t visit) {
  std::vector<std::vector<OrientedBox>> places(visit + 1);
  for (std::size_t v = 0; v <= visit; ++v) {
    for (const TruthObject& object : truth.objects[v]) places[v].push_back(object.box);
  }
  return places;
}

void note(const FrameResult& result, std::size_t frame,
          const std::vector<std::vector<OrientedBox>>& places, double tolerance_m, Contestant& c) {
  c.score.refused += !result.accepted;
  for (const ObjectEvent& event : result.events) {
    c.run.events.push_back({event, frame});
    c.score.removed_or_moved +=
        event.kind == EventKind::kRemoved || event.kind == EventKind::kMoved;
    if (event.kind == EventKind::kRemoved) {
      c.score.histories[event.object].emplace_back(frame, event.evidence.after.stationarity());
    }
  }
  for (const ObjectSnapshot& object : result.changed_objects) {
    c.score.histories[object.id].emplace_back(frame, object.belief.stationarity());
    if (!places.empty()) {
      c.score.calibration.add(object.belief.stationarity(),
                              place_is_held(object.box, places, tolerance_m));
    }
  }
}

}  // namespace

RunScore evaluate_run(EvaluationInput input, const std::vector<MethodSpec>& methods,
                      const VoxelMetricsConfig& voxels, double max_depth_m,
                      const std::function<void(std::size_t)>& progress) {
  POCD_CHECK(!input.visit_begin.empty() && input.visit_begin.front() == 0);
  std::vector<Contestant> contestants;
  for (const MethodSpec& spec : methods) {
    contestants.emplace_back();
    contestants.back().score.method = spec.name;
    contestants.back().route = spec.make();
    if (input.with_reference) contestants.back().alone = spec.make();
  }
  ObservedRegion measured(voxels.map_voxel_m, max_depth_m, kSeenMargin_voxels * voxels.map_voxel_m);
  const std::size_t last = input.visit_begin.size() - 1;
  std::size_t frames = 0, last_frames = 0;
  std::optional<StampNs> start_ns;
  std::vector<std::vector<OrientedBox>> places;
  while (auto frame = input.reader->next()) {
    if (!start_ns) start_ns = frame->stamp_ns;
    const std::size_t visit = visit_of(frame->sequence, input.visit_begin);
    if (input.with_reference && visit == last && last_frames % kRegionStride == 0) {
      measured.add(*frame, kRegionStride);
    }
    inject_faults(input.faults, *start_ns, *frame);
    if (input.truth && places.size() != visit + 1) places = places_until(*input.truth, visit);
    for (Contestant& c : contestants) {
      while (c.run.objects_at_visit_begin.size() <= visit) {
        c.run.objects_at_visit_begin.push_back(c.route->objects());
      }
      const double before_ms = thread_cpu_ms();
      const FrameResult result = c.route->process(*frame);
      c.cpu_total_ms += thread_cpu_ms() - before_ms;
      note(result, static_cast<std::size_t>(frame->sequence), places,
           input.truth ? input.truth->place_tolerance_m : kPlaceTolerance_m, c);
      if (visit == last && c.alone) c.alone->process(*frame);
    }
    last_frames += visit == last;
    ++frames;
    if (progress) progress(frames);
  }
  if (last_frames == 0) throw InputError(input.route + ": no good frame in the last visit");

  RunScore run;
  run.route = input.route;
  run.seed = input.seed;
  run.problems = input.reader->problems();
  for (Contestant& c : contestants) {
    const Points map_W = c.route->surface();
    if (c.alone) {
      c.score.by_reference = score_against_reference(map_W, c.alone->surface(), measured, voxels);
    }
    if (input.truth) {
      c.score.by_truth =
          score_against_truth(map_W, input.truth->surface, input.truth->observed, voxels);
      if (c.route->has_objects()) c.score.objects = score_objects(c.run, *input.truth);
    }
    c.score.frames = frames;
    c.score.cpu_ms_per_frame = c.cpu_total_ms / static_cast<double>(frames);
    c.score.events = std::move(c.run.events);
    run.methods.push_back(std::move(c.score));
  }
  return run;
}

}  // namespace pocd

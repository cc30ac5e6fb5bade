#include "pocd/eval/state_check.hpp"

#include <algorithm>
#include <cstdio>

#include "pocd/datasets/readers.hpp"
#include "pocd/eval/assignment.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace pocd {
namespace {

double nearest_listed_m(const ExpectedObject& thing, const Eigen::Vector3d& center_W) {
  double best = (thing.listed_W - center_W).norm();
  for (const Eigen::Vector3d& earlier : thing.earlier_W)
    best = std::min(best, (earlier - center_W).norm());
  return best;
}

double box_distance_m(const ExpectedObject& thing, const Eigen::Vector3d& center_W) {
  return (thing.box.pose.position_W - center_W).norm();
}

/// Pairs that are certainly of one thing: as far apart as half a thing.
constexpr double kPairing_m = 0.12;

template <class... Args>
void print(std::string& text, const char* format, Args... args) {
  char line[256];
  std::snprintf(line, sizeof(line), format, args...);
  text += line;
}

}  // namespace

StateVerdict judge_state(const std::vector<ObjectSnapshot>& objects, const ExpectedState& expected,
                         double tolerance_m) {
  StateVerdict verdict;
  verdict.state = expected.state;
  std::vector<AssignmentCandidate> pairs;
  for (std::size_t e = 0; e < expected.objects.size(); ++e) {
    for (std::size_t o = 0; o < objects.size(); ++o) {
      const double cost =
          std::min(nearest_listed_m(expected.objects[e], objects[o].centroid_W),
                   box_distance_m(expected.objects[e], objects[o].box.pose.position_W));
      if (cost < kPairing_m) pairs.push_back({static_cast<int>(e), static_cast<int>(o), cost});
    }
  }
  std::vector<bool> expected_used(expected.objects.size()), object_used(objects.size());
  for (const AssignedPair& pair : assign(pairs, kPairing_m)) {
    const auto e = static_cast<std::size_t>(pair.row), o = static_cast<std::size_t>(pair.column);
    verdict.matches.push_back(
        {e, objects[o].id, nearest_listed_m(expected.objects[e], objects[o].centroid_W),
         box_distance_m(expected.objects[e], objects[o].box.pose.position_W)});
    expected_used[e] = object_used[o] = true;
  }
  for (std::size_t e = 0; e < expected.objects.size(); ++e) {
    if (!expected_used[e]) verdict.missing.push_back(e);
  }
  for (std::size_t o = 0; o < objects.size(); ++o) {
    if (object_used[o]) continue;
    const bool hidden =
        std::any_of(expected.hidden.begin(), expected.hidden.end(), [&](const auto& h) {
          return std::min(nearest_listed_m(h, objects[o].centroid_W),
                          box_distance_m(h, objects[o].box.pose.position_W)) <= tolerance_m;
        });
    (hidden ? verdict.kept_hidden : verdict.extra).push_back(objects[o].id);
  }
  verdict.ok_listed = verdict.ok_box = verdict.missing.empty() && verdict.extra.empty();
  for (const StateMatch& match : verdict.matches) {
    verdict.ok_listed &= match.listed_m <= tolerance_m;
    verdict.ok_box &= match.box_m <= tolerance_m || match.listed_m <= tolerance_m;
  }
  return verdict;
}

StateRun run_states(const StateTruth& truth, const std::filesystem::path& folder,
                    const PipelineConfig& config, const std::function<void(const StateRun&)>& done,
                    bool with_masks) {
  StateRun run;
  run.expected = expected_states(truth, folder);
  DatasetOptions options = state_dataset(truth, folder);
  options.label_divisor = config.classes.label_divisor;
  const auto reader = open_pcd(options);
  PocdPipeline pipeline(config);
  for (const ExpectedState& expected : run.expected) {
    run.events.emplace_back();
    for (int i = 0; i < truth.frames_per_state; ++i) {
      auto frame = reader->next();
      if (!frame) break;
      if (!with_masks) frame->labels = cv::Mat();
      const FrameResult result = pipeline.process_frame(*frame);
      run.events.back().insert(run.events.back().end(), result.events.begin(), result.events.end());
    }
    run.objects.push_back(pipeline.objects());
    run.verdicts.push_back(judge_state(run.objects.back(), expected, truth.tolerance_m));
    if (done) done(run);
  }
  return run;
}

std::string describe_last_state(const StateRun& run) {
  const StateVerdict& verdict = run.verdicts.back();
  const ExpectedState& expected = run.expected[run.verdicts.size() - 1];
  const auto& objects = run.objects.back();
  std::string text;
  print(text, "state %d: %s (box centres: %s)  %zu of %zu found, %zu hidden kept, %zu extra\n",
        verdict.state, verdict.ok_listed ? "OK" : "wrong", verdict.ok_box ? "OK" : "wrong",
        verdict.matches.size(), expected.objects.size(), verdict.kept_hidden.size(),
        verdict.extra.size());
  for (const ObjectSnapshot& object : objects) {
    const Eigen::Vector3d& p = object.box.pose.position_W;
    const Eigen::Vector3d& s = object.box.size_m;
    print(text,
          "  object %3u  centre %6.3f %6.3f %6.3f  yaw %6.1f deg  size %.3f %.3f %.3f  E[v] %.3f",
          to_index(object.id), p.x(), p.y(), p.z(), object.box.pose.yaw_rad * 180.0 / M_PI, s.x(),
          s.y(), s.z(), object.belief.stationarity());
    for (const StateMatch& match : verdict.matches) {
      if (match.object != object.id) continue;
      print(text, "  is thing %zu, %.3f m from listed, %.3f m from its box", match.expected,
            match.listed_m, match.box_m);
    }
    const auto has = [&](const std::vector<ObjectId>& ids) {
      return std::find(ids.begin(), ids.end(), object.id) != ids.end();
    };
    if (has(verdict.kept_hidden)) text += "  hidden thing";
    if (has(verdict.extra)) text += "  EXTRA";
    text += '\n';
  }
  for (std::size_t e = 0; e < expected.objects.size(); ++e) {
    const ExpectedObject& thing = expected.objects[e];
    const Eigen::Vector3d& c = thing.box.pose.position_W;
    const Eigen::Vector3d& s = thing.box.size_m;
    const bool missing =
        std::find(verdict.missing.begin(), verdict.missing.end(), e) != verdict.missing.end();
    print(text,
          "  thing  %3zu  listed %6.3f %6.3f %6.3f  box %6.3f %6.3f %6.3f  size %.3f %.3f %.3f%s\n",
          e, thing.listed_W.x(), thing.listed_W.y(), thing.listed_W.z(), c.x(), c.y(), c.z(), s.x(),
          s.y(), s.z(), missing ? "  MISSING" : "");
  }
  for (const ObjectEvent& event : run.events.back()) {
    const Eigen::Vector3d& p = event.box.pose.position_W;
    print(text, "  frame %3llu  %-7s object %3u  at %6.3f %6.3f %6.3f  %s\n",
          static_cast<unsigned long long>(event.frame_sequence), to_string(event.kind),
          to_index(event.object), p.x(), p.y(), p.z(), event.evidence.rule.c_str());
  }
  return text;
}

}  // namespace pocd

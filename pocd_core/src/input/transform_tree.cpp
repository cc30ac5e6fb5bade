#include "pocd/input/transform_tree.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <set>

namespace pocd {
namespace {

std::string seconds_text(StampNs stamp_ns) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3f s", static_cast<double>(stamp_ns) * 1e-9);
  return text;
}

/// No delay is so long.
std::string clocks_text(const TransformLookup& failure, StampNs stamp_ns) {
  constexpr StampNs kNoDelay = 60'000'000'000;
  if (stamp_ns == 0 && failure.off_ns > kNoDelay) return ": does the camera set no stamps?";
  return failure.off_ns > kNoDelay ? ": camera and poses have different clocks" : "";
}

/// Seconds to write into an option: not less than this, to a tenth.
std::string tenths_above(StampNs ns) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f", std::ceil(static_cast<double>(ns) * 1e-8) * 0.1);
  return text;
}

/// Poses that come seldom, or late, can be held; what is sent once is static.
std::string held_text(const TransformLookup& failure, const PoseBuffer* poses) {
  if (poses != nullptr && poses->size() == 1) {
    return "; it came once: a transform that does not change belongs on tf_static";
  }
  constexpr StampNs kLongestHeld = 1'000'000'000;  // of node.extrapolation_s
  if (failure.off_ns > kLongestHeld) return "";
  return "; --set node.extrapolation_s=" + tenths_above(failure.off_ns) + " holds that pose";
}

InputProblem gap_problem(const TransformLookup& failure, const std::pair<StampNs, StampNs>& around,
                         StampNs stamp_ns) {
  return {InputReason::kNoPose,
          failure.edge + ": no pose is between " + seconds_text(around.first) + " and " +
              seconds_text(around.second) + ", the image is of " + seconds_text(stamp_ns) +
              " (--set node.max_pose_gap_s=" + tenths_above(around.second - around.first) +
              " interpolates over so long)"};
}

InputProblem parent_changed(const std::string& child, const std::string& old_parent,
                            const std::string& parent) {
  return {InputReason::kParentChanged,
          "frame \"" + child + "\" had parent \"" + old_parent + "\", now \"" + parent + "\""};
}

// Names come from peers, and every frame keeps poses.
constexpr std::size_t kMostFrames = 10000;

InputProblem too_many(const std::string& child) {
  return {InputReason::kTooLarge, "frame \"" + child + "\" is left out: there are " +
                                      std::to_string(kMostFrames) + " already"};
}

}  // namespace

TransformTree::TransformTree(StampNs max_gap_ns, std::size_t capacity, const TransformTree* shared)
    : max_gap_ns_(max_gap_ns), capacity_(capacity), shared_(shared) {}

std::optional<InputProblem> TransformTree::set_static(const std::string& parent,
                                                      const std::string& child,
                                                      const PoseQuaternion& T) {
  std::optional<InputProblem> problem;
  const auto edge = edges_.find(child);
  if (edge == edges_.end() && edges_.size() >= kMostFrames) return too_many(child);
  if (edge != edges_.end() && edge->second.parent != parent) {
    problem = parent_changed(child, edge->second.parent, parent);
  }
  edges_.insert_or_assign(child, Edge{parent, true, T, PoseBuffer(max_gap_ns_, capacity_)});
  return problem;
}

std::optional<InputProblem> TransformTree::add(const std::string& parent, const std::string& child,
                                               StampNs stamp_ns, const PoseQuaternion& T) {
  std::optional<InputProblem> problem;
  auto edge = edges_.find(child);
  if (edge == edges_.end() && edges_.size() >= kMostFrames) return too_many(child);
  if (edge == edges_.end() || edge->second.parent != parent || edge->second.is_static) {
    if (edge != edges_.end() && edge->second.parent != parent) {
      problem = parent_changed(child, edge->second.parent, parent);
    }
    edge = edges_.insert_or_assign(child, Edge{parent, false, {}, {max_gap_ns_, capacity_}}).first;
  }
  PoseBuffer& buffer = edge->second.buffer;
  const StampNs before_ns = buffer.empty() ? stamp_ns : buffer.newest_ns();
  if (auto late = stamp_problem(buffer.add(stamp_ns, T), stamp_ns, before_ns)) {
    late->detail = parent + " -> " + child + ": " + late->detail;
    return late;
  }
  return problem;
}

void TransformTree::forget_moving() {
  for (auto edge = edges_.begin(); edge != edges_.end();) {
    edge = edge->second.is_static ? std::next(edge) : edges_.erase(edge);
  }
}

void TransformTree::forget_moving(const std::vector<std::string>& frames) {
  std::vector<std::string> gone;
  for (const auto& [child, edge] : edges_) {
    if (edge.is_static) continue;
    for (const std::string& frame : chain("", child)) {
      if (std::find(frames.begin(), frames.end(), frame) == frames.end()) continue;
      gone.push_back(child);
      break;
    }
  }
  for (const std::string& child : gone) edges_.erase(child);
}

std::vector<std::string> TransformTree::chain(const std::string& target,
                                              const std::string& source) const {
  std::vector<std::string> frames;
  std::string frame = source;
  for (std::size_t steps = 0; frame != target && steps <= size(); ++steps) {
    frames.push_back(frame);
    const Edge* edge = find(frame);
    if (edge == nullptr) break;
    frame = edge->parent;
  }
  return frames;
}

const TransformTree::Edge* TransformTree::find(const std::string& child) const {
  const auto found = edges_.find(child);
  if (found != edges_.end()) return &found->second;
  return shared_ == nullptr ? nullptr : shared_->find(child);
}

TransformLookup TransformTree::lookup(const std::string& target, const std::string& source,
                                      StampNs stamp_ns, StampNs extrapolation_ns) const {
  const TransformLookup straight = climb(target, source, stamp_ns, extrapolation_ns);
  if (straight.result != PoseLookup::kEmpty || find(target) == nullptr) return straight;
  const std::vector<std::string> above_source = chain("", source);
  for (const std::string& common : chain("", target)) {
    if (std::find(above_source.begin(), above_source.end(), common) == above_source.end()) continue;
    TransformLookup answer = climb(common, source, stamp_ns, extrapolation_ns);
    if (answer.result != PoseLookup::kFound) return answer;
    const TransformLookup of_target = climb(common, target, stamp_ns, extrapolation_ns);
    if (of_target.result != PoseLookup::kFound) return of_target;
    answer.T_target_source = of_target.T_target_source.inverse() * answer.T_target_source;
    return answer;
  }
  return straight;
}

TransformLookup TransformTree::climb(const std::string& target, const std::string& source,
                                     StampNs stamp_ns, StampNs extrapolation_ns) const {
  TransformLookup answer;
  std::string frame = source;
  const std::size_t most_steps = size();
  for (std::size_t steps = 0; frame != target; ++steps) {
    const Edge* edge = find(frame);
    if (edge == nullptr) {
      answer.result = PoseLookup::kEmpty;
      answer.edge = "? -> " + frame;
      return answer;
    }
    answer.edge = edge->parent + " -> " + frame;
    answer.child = frame;
    if (steps > most_steps) {  // longer than there are edges
      answer.result = PoseLookup::kLoop;
      return answer;
    }
    PoseQuaternion pose = edge->constant;
    if (!edge->is_static) {
      answer.result = edge->buffer.at(stamp_ns, extrapolation_ns, pose);
      if (answer.result == PoseLookup::kTooNew) answer.off_ns = stamp_ns - edge->buffer.newest_ns();
      if (answer.result == PoseLookup::kTooOld) answer.off_ns = edge->buffer.oldest_ns() - stamp_ns;
      if (answer.result != PoseLookup::kFound) return answer;
    }
    answer.T_target_source = to_pose(pose) * answer.T_target_source;
    frame = edge->parent;
  }
  answer.result = PoseLookup::kFound;
  answer.edge.clear();
  return answer;
}

InputProblem TransformTree::explain(const std::string& target, const std::string& source,
                                    StampNs stamp_ns, const TransformLookup& failure) const {
  std::string chain = source, frame = source;
  const Edge* last = nullptr;
  std::set<std::string> passed;
  while (frame != target && passed.insert(frame).second) {
    const Edge* edge = find(frame);
    if (edge == nullptr) break;
    chain += " <- " + edge->parent;
    last = edge;
    if (failure.result != PoseLookup::kLoop && edge->parent + " -> " + frame == failure.edge) break;
    frame = edge->parent;
  }
  // What a robot moves in may be meant as the map.
  const std::string hint =
      last != nullptr && !last->is_static
          ? "; is it the frame of the map? (--set node.map_frame=" + frame + ")"
          : "";
  const Edge* failed = find(failure.child);
  switch (failure.result) {
    case PoseLookup::kEmpty:
      return {InputReason::kNoTransform, "no transform leads from \"" + source + "\" to \"" +
                                             target + "\": nobody says where \"" + frame +
                                             "\" is (" + chain + ")" + hint};
    case PoseLookup::kLoop:
      return {InputReason::kTransformLoop,
              "frames go round in a loop and never reach \"" + target + "\": " + chain};
    case PoseLookup::kTooNew:
      return {
          InputReason::kNoPose,
          failure.edge + ": newest pose is of " +
              (failed == nullptr ? std::string("?") : seconds_text(failed->buffer.newest_ns())) +
              ", the image of " + seconds_text(stamp_ns) + clocks_text(failure, stamp_ns) +
              held_text(failure, failed == nullptr ? nullptr : &failed->buffer)};
    case PoseLookup::kTooOld:
      return {
          InputReason::kNoPose,
          failure.edge + ": oldest pose is of " +
              (failed == nullptr ? std::string("?") : seconds_text(failed->buffer.oldest_ns())) +
              ", the image of " + seconds_text(stamp_ns) + clocks_text(failure, stamp_ns)};
    case PoseLookup::kGap:
      if (failed != nullptr) return gap_problem(failure, failed->buffer.around(stamp_ns), stamp_ns);
      break;
    case PoseLookup::kFound:
      break;
  }
  return {InputReason::kNoPose, failure.edge + ": the image of " + seconds_text(stamp_ns) + " is " +
                                    to_string(failure.result)};
}

}  // namespace pocd

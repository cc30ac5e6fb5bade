#include "pocd/input/transform_tree.hpp"

#include <iterator>

namespace pocd {

TransformTree::TransformTree(StampNs max_gap_ns, std::size_t capacity)
    : max_gap_ns_(max_gap_ns), capacity_(capacity) {}

void TransformTree::set_static(const std::string& parent, const std::string& child,
                               const PoseQuaternion& T) {
  edges_.insert_or_assign(child, Edge{parent, true, T, PoseBuffer(max_gap_ns_, capacity_)});
}

bool TransformTree::add(const std::string& parent, const std::string& child, StampNs stamp_ns,
                        const PoseQuaternion& T) {
  auto edge = edges_.find(child);
  if (edge == edges_.end() || edge->second.parent != parent || edge->second.is_static) {
    edge = edges_.insert_or_assign(child, Edge{parent, false, {}, {max_gap_ns_, capacity_}}).first;
  }
  return edge->second.buffer.add(stamp_ns, T);
}

void TransformTree::forget_moving() {
  for (auto edge = edges_.begin(); edge != edges_.end();) {
    edge = edge->second.is_static ? std::next(edge) : edges_.erase(edge);
  }
}

TransformLookup TransformTree::lookup(const std::string& target, const std::string& source,
                                      StampNs stamp_ns, StampNs extrapolation_ns) const {
  TransformLookup answer;
  std::string frame = source;
  // A chain longer than the number of edges has a loop.
  for (std::size_t steps = 0; frame != target; ++steps) {
    const auto found = edges_.find(frame);
    if (found == edges_.end() || steps > edges_.size()) {
      answer.result = PoseLookup::kEmpty;
      answer.edge = "? -> " + frame;
      return answer;
    }
    const Edge& edge = found->second;
    PoseQuaternion pose = edge.constant;
    if (!edge.is_static) {
      const PoseLookup result = edge.buffer.at(stamp_ns, extrapolation_ns, pose);
      if (result != PoseLookup::kFound) {
        answer.result = result;
        answer.edge = edge.parent + " -> " + frame;
        return answer;
      }
    }
    answer.T_target_source = to_pose(pose) * answer.T_target_source;
    frame = edge.parent;
  }
  answer.result = PoseLookup::kFound;
  return answer;
}

}  // namespace pocd

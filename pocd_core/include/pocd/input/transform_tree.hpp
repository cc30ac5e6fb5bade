// Coordinate frames and the transforms between them, as tf and tf_static describe them.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "pocd/common/types.hpp"
#include "pocd/input/pose_buffer.hpp"

namespace pocd {

/// What a lookup gave; `edge` names the transform "parent -> child" that a failure is about.
struct TransformLookup {
  PoseLookup result = PoseLookup::kEmpty;
  Pose T_target_source = Pose::Identity();
  std::string edge;
};

/// Every frame has one parent. Not thread-safe.
class TransformTree {
 public:
  explicit TransformTree(StampNs max_gap_ns, std::size_t capacity = 1000);

  /// A transform that holds for all time; replaces what was known of `child`.
  void set_static(const std::string& parent, const std::string& child, const PoseQuaternion& T);
  /// False when the stamp jumped backwards; the pose is not stored then. A child that changes its
  /// parent starts anew.
  bool add(const std::string& parent, const std::string& child, StampNs stamp_ns,
           const PoseQuaternion& T);

  /// Forgets everything that is not static.
  void forget_moving();

  /// T_target_source at the stamp; `target` must be an ancestor of `source` (or the same frame).
  /// kEmpty: no chain of parents leads from source to target; `edge` names the frame where it ends.
  TransformLookup lookup(const std::string& target, const std::string& source, StampNs stamp_ns,
                         StampNs extrapolation_ns) const;

 private:
  struct Edge {
    std::string parent;
    bool is_static = false;
    PoseQuaternion constant;
    PoseBuffer buffer;
  };
  StampNs max_gap_ns_;
  std::size_t capacity_;
  std::map<std::string, Edge> edges_;  // by child
};

}  // namespace pocd

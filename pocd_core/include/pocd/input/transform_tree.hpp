// Coordinate frames and the transforms between them, as odometry, tf and tf_static describe them.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pocd/common/types.hpp"
#include "pocd/input/input_problem.hpp"
#include "pocd/input/pose_buffer.hpp"

namespace pocd {

/// T_parent_child at a stamp.
struct StampedTransform {
  std::string parent, child;
  StampNs stamp_ns = 0;
  PoseQuaternion T;
};

/// What a lookup gave; `edge` names the transform "parent -> child" that a failure is about.
struct TransformLookup {
  PoseLookup result = PoseLookup::kEmpty;
  Pose T_target_source = Pose::Identity();
  std::string edge;
  std::string child;   ///< of that transform
  StampNs off_ns = 0;  ///< of kTooNew and kTooOld: how far the stamp lies beyond the poses
};

/// Every frame has one parent. Not thread-safe.
class TransformTree {
 public:
  /// What is not known of a frame here is looked up in `shared`, which must outlive the tree: a
  /// robot's own odometry goes before what tf says of the same frame.
  explicit TransformTree(StampNs max_gap_ns, std::size_t capacity = 1000,
                         const TransformTree* shared = nullptr);

  /// A transform that holds for all time; replaces what was known of `child`. kParentChanged when
  /// that had another parent; kTooLarge, and nothing stored, for one frame more than there may be.
  std::optional<InputProblem> set_static(const std::string& parent, const std::string& child,
                                         const PoseQuaternion& T);
  /// kStampBackwards, kTooLarge: the pose is not stored. kParentChanged, kStampsRestarted: it is,
  /// and the child starts anew.
  std::optional<InputProblem> add(const std::string& parent, const std::string& child,
                                  StampNs stamp_ns, const PoseQuaternion& T);

  /// Forgets everything here that is not static.
  void forget_moving();
  /// Forgets what is not static at these frames and at all that hang on them.
  void forget_moving(const std::vector<std::string>& frames);

  /// The frames from `source` up to the one before `target`, as far as they are known.
  std::vector<std::string> chain(const std::string& target, const std::string& source) const;

  /// T_target_source at the stamp. As with tf2, `target` need not be an ancestor of `source`: they
  /// may have one in common (an odometry that is sent inverted makes the map a child of the robot).
  /// kEmpty: they have none; `edge` names the frame where the chain of parents of `source` ends.
  /// kLoop: the parents go round.
  TransformLookup lookup(const std::string& target, const std::string& source, StampNs stamp_ns,
                         StampNs extrapolation_ns) const;
  /// The same failure in words, with the names of the frames on the way.
  InputProblem explain(const std::string& target, const std::string& source, StampNs stamp_ns,
                       const TransformLookup& failure) const;

 private:
  /// lookup() where `target` is an ancestor.
  TransformLookup climb(const std::string& target, const std::string& source, StampNs stamp_ns,
                        StampNs extrapolation_ns) const;
  struct Edge {
    std::string parent;
    bool is_static = false;
    PoseQuaternion constant;
    PoseBuffer buffer;
  };
  const Edge* find(const std::string& child) const;
  std::size_t size() const { return edges_.size() + (shared_ ? shared_->size() : 0); }

  StampNs max_gap_ns_;
  std::size_t capacity_;
  const TransformTree* shared_;
  std::map<std::string, Edge> edges_;  // by child
};

}  // namespace pocd

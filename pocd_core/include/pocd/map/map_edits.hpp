// What becomes of the voxels of objects: noted while a frame is worked on, done before the frame is
// integrated.
#pragma once

#include <functional>
#include <vector>

#include "pocd/common/types.hpp"

namespace pocd {

class TsdfMap;

/// A list of changes, in the order in which they were noted. Not thread-safe.
class MapEdits {
 public:
  /// Whether a voxel with its centre there [m, W] is meant.
  using Where = std::function<bool(const Eigen::Vector3d&)>;

  /// The object's voxels become unknown: those that `where` accepts, or all. clears() and
  /// apply_to() call `where`: what it refers to must last until then.
  void clear(ObjectId id, Where where = {});
  /// Voxels of `from` become voxels of `to`.
  void reassign(ObjectId from, ObjectId to);

  /// Whether a voxel that the object owns now, with its centre there [m, W], will be unknown.
  bool clears(ObjectId owner, const Eigen::Vector3d& center_W) const;
  bool empty() const { return edits_.empty(); }

  /// Makes all noted changes, and forgets them.
  void apply_to(TsdfMap& map);

 private:
  struct Edit {
    ObjectId id;
    ObjectId to;
    bool clears;
    Where where;
  };
  std::vector<Edit> edits_;
};

}  // namespace pocd

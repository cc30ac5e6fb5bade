#include "pocd/map/map_edits.hpp"

#include <utility>

#include "pocd/map/tsdf_map.hpp"

namespace pocd {

void MapEdits::clear(ObjectId id, Where where) {
  edits_.push_back({id, ObjectId::kNone, true, std::move(where)});
}

void MapEdits::reassign(ObjectId from, ObjectId to) { edits_.push_back({from, to, false, {}}); }

bool MapEdits::clears(ObjectId owner, const Eigen::Vector3d& center_W) const {
  for (const Edit& edit : edits_) {
    if (edit.id != owner) continue;
    if (!edit.clears) {
      owner = edit.to;
    } else if (!edit.where || edit.where(center_W)) {
      return true;
    }
  }
  return false;
}

void MapEdits::apply_to(TsdfMap& map) {
  for (const Edit& edit : edits_) {
    if (!edit.clears) {
      map.reassign_object(edit.id, edit.to);
    } else if (edit.where) {
      map.clear_object_where(edit.id, edit.where);
    } else {
      map.clear_object(edit.id);
    }
  }
  edits_.clear();
}

}  // namespace pocd

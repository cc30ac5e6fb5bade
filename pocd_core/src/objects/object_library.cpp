#include "pocd/objects/object_library.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

constexpr double kCellM = 2.0;

std::int32_t cell_of(double v) { return static_cast<std::int32_t>(std::floor(v / kCellM)); }

}  // namespace

bool LibraryObject::note_seer(const std::string& robot) {
  if (seen_by.size() >= kMostSeers) return seen_by.count(robot) > 0;
  seen_by.insert(robot);
  return true;
}

LibraryObject& ObjectLibrary::create(double spacing_m) {
  const ObjectId id{next_id_++};
  touch(id);
  return *objects_.emplace(id, std::make_unique<LibraryObject>(id, spacing_m)).first->second;
}

LibraryObject* ObjectLibrary::find(ObjectId id) {
  const auto it = objects_.find(id);
  if (it != objects_.end()) touch(id);
  return it == objects_.end() ? nullptr : it->second.get();
}

const LibraryObject* ObjectLibrary::find(ObjectId id) const {
  const auto it = objects_.find(id);
  return it == objects_.end() ? nullptr : it->second.get();
}

void ObjectLibrary::erase(ObjectId id) {
  touch_gone(id);
  unfile(id);
  objects_.erase(id);
}

void ObjectLibrary::rename(ObjectId from, ObjectId to) {
  POCD_CHECK(find(to) == nullptr);
  const auto it = objects_.find(from);
  POCD_CHECK(it != objects_.end());
  touch_gone(from);
  touch(to);
  unfile(from);
  std::unique_ptr<LibraryObject> object = std::move(it->second);
  objects_.erase(it);
  object->id = to;
  LibraryObject& moved = *objects_.emplace(to, std::move(object)).first->second;
  place(moved, moved.box);
}

void ObjectLibrary::touch_gone(ObjectId id) {
  if (to_index(id) < untold_id_) {
    touch(id);
  } else {
    touched_.erase(id);
  }
}

std::set<ObjectId> ObjectLibrary::take_touched() {
  std::set<ObjectId> ids = std::move(touched_);
  touched_.clear();
  untold_id_ = next_id_;
  if (!std::exchange(notes_touched_, true)) {
    for (const auto& entry : objects_) ids.insert(entry.first);
  }
  return ids;
}

void ObjectLibrary::unfile(ObjectId id) {
  const auto filed = filed_.find(to_index(id));
  if (filed == filed_.end()) return;
  for (const Cell cell : filed->second) {
    const auto it = grid_.find(cell);
    auto& ids = it->second;
    ids.erase(std::remove(ids.begin(), ids.end(), id), ids.end());
    if (ids.empty()) grid_.erase(it);
  }
  filed_.erase(filed);
}

ObjectLibrary::Cell ObjectLibrary::cell_at(std::int32_t x, std::int32_t y) {
  return static_cast<Cell>(static_cast<std::uint32_t>(x)) << 32 | static_cast<std::uint32_t>(y);
}

std::vector<ObjectLibrary::Cell> ObjectLibrary::cells_of(const Eigen::Vector2d& low,
                                                         const Eigen::Vector2d& high) {
  std::vector<Cell> cells;
  for (std::int32_t y = cell_of(low.y()); y <= cell_of(high.y()); ++y) {
    for (std::int32_t x = cell_of(low.x()); x <= cell_of(high.x()); ++x) {
      cells.push_back(cell_at(x, y));
    }
  }
  return cells;
}

void ObjectLibrary::place(LibraryObject& object, const OrientedBox& box) {
  object.box = box;
  unfile(object.id);
  const double reach = 0.5 * box.size_m.head<2>().norm();
  const Eigen::Vector2d center = box.pose.position_W.head<2>();
  auto& filed = filed_[to_index(object.id)];
  filed = cells_of(center.array() - reach, center.array() + reach);
  for (const Cell cell : filed) grid_[cell].push_back(object.id);
}

std::vector<ObjectId> ObjectLibrary::near(const Eigen::Vector3d& center_W, double radius_m) const {
  std::vector<ObjectId> ids;
  for (const Cell cell :
       cells_of(center_W.head<2>().array() - radius_m, center_W.head<2>().array() + radius_m)) {
    const auto it = grid_.find(cell);
    ++visits_;
    if (it != grid_.end()) ids.insert(ids.end(), it->second.begin(), it->second.end());
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  visits_ += ids.size();
  return ids;
}

ObjectSnapshot snapshot(const LibraryObject& object) {
  ObjectSnapshot s;
  s.id = object.id;
  s.class_id = object.class_id;
  s.stationarity_class = object.stationarity_class;
  s.box = object.box;
  s.centroid_W = object.centroid_W;
  s.belief = object.belief;
  s.first_seen_ns = object.first_seen_ns;
  s.last_seen_ns = object.last_seen_ns;
  s.observations = object.observations;
  s.last_robot = object.last_robot;
  s.seen_by.assign(object.seen_by.begin(), object.seen_by.end());
  return s;
}

}  // namespace pocd

// The objects the system believes in, and those it is about to.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "pocd/objects/frame_result.hpp"
#include "pocd/objects/object_model.hpp"
#include "pocd/registration/icp_target.hpp"

namespace pocd {

/// The views of an object that count as one: of different robots, within a short time.
struct Moment {
  StampNs start_ns = 0;
  StampNs frame_ns = 0;             ///< of the last view
  std::vector<std::string> robots;  ///< that have looked, in that order
  Belief before;                    ///< before any of the views
  bool measured = false;            ///< a view has gone into the belief
  bool observed = false;            ///< a view has been counted as observation
  bool seen_through = false;        ///< a view has been counted as seen through
  int points = 0;                   ///< of the object, that the view in the belief told of
};

/// What the system knows of one thing: the paper's fields, and where it is in its life.
struct LibraryObject {
  LibraryObject(ObjectId object_id, double spacing_m) : id(object_id), model(spacing_m) {}

  /// Names may be new with each run of a robot, and every state of the object carries them all.
  static constexpr std::size_t kMostSeers = 100;
  /// False when there is no room for the name.
  bool note_seer(const std::string& robot);

  // The thing.
  ObjectId id;
  ClassId class_id = 0;
  int stationarity_class = 0;
  ObjectModel model;
  OrientedBox box;
  Eigen::Vector3d centroid_W = Eigen::Vector3d::Zero();  ///< mean of the surface
  Belief belief;
  Arrival arrival = Arrival::kUnknown;
  bool moved = false;  ///< it moved as a whole: what it touches is not of it

  // Who saw it, when.
  StampNs first_seen_ns = 0;
  StampNs last_seen_ns = 0;
  StampNs in_reach_ns = 0;  ///< the last frame in whose reach it lay, seen or hidden
  StampNs visit_ns = 0;     ///< when the visit began that this frame belongs to
  StampNs placed_ns = 0;    ///< since when it is known where it is: first seen, or moved, then
  StampNs in_place_ns = 0;  ///< the last look that found it in its place
  std::string last_robot;
  std::set<std::string> seen_by;   ///< robots that have observed it, kMostSeers of them at most
  Moment moment;                   ///< the last one
  std::uint32_t observations = 0;  ///< of a candidate without a class: on this visit

  // Where it is in its life.
  bool confirmed = false;           ///< false: tentative, known to nobody outside
  std::optional<StampNs> added_ns;  ///< when it was reported as ADDED; unset once it was moved
  OrientedBox reported_box;         ///< as in the last event
  bool changed = false;             ///< since the last FrameResult
  int looks_missed = 0;             ///< tentative only: in view without being fused
  int looks_unobserved = 0;         ///< in a row: its place was seen empty
  StampNs unobserved_since_ns = 0;  ///< the first of them
  int looks_displaced = 0;  ///< found it beside its place, since one found it there uncontested
  StampNs displaced_since_ns = 0;  ///< the first of them
  int looks_losing = 0;            ///< in a row: a part of it is seen through
  std::size_t lost = 0;            ///< points eroded since the last event
  /// Objects seen in one piece with it: in how many looks, or kToldApart.
  std::map<ObjectId, int> companions;
  static constexpr int kToldApart = -1;  ///< masks showed them as two things

  std::size_t box_surfels = 0;  ///< size of the model when the box was fitted
  std::size_t most_surfels = 0;
  double most_free = 0.0;  ///< largest Observation::free_beside_share of a look
  /// Alignment target made of the model; dropped when the model changes.
  std::shared_ptr<const IcpTarget> icp_target;
};

/// Objects by id, with a grid over the ground plane to find those near a place: a frame's cost
/// depends on what is in view. Not thread-safe.
class ObjectLibrary {
 public:
  LibraryObject& create(double spacing_m);
  /// An id that no object has or gets: for a part that leaves an object.
  ObjectId reserve_id() { return ObjectId{next_id_++}; }
  LibraryObject* find(ObjectId id);
  const LibraryObject* find(ObjectId id) const;
  void erase(ObjectId id);
  /// Gives the object another id, which must be free. Pointers to it stay valid.
  void rename(ObjectId from, ObjectId to);

  /// Sets the box and files the object where it lies.
  void place(LibraryObject& object, const OrientedBox& box);

  /// Ids of objects whose box may lie within `radius_m` of `center_W` (horizontally), ascending.
  std::vector<ObjectId> near(const Eigen::Vector3d& center_W, double radius_m) const;

  /// Ids of objects that may have changed, come or gone since the last call: all that were handed
  /// out for change. For who writes them down; noted from the first call on. Those that came and
  /// went since are left out: candidates would be listed without end when nobody asks any more.
  std::set<ObjectId> take_touched();
  /// All of them have been changed, through all().
  void touch_all() {
    for (const auto& entry : objects_) touch(entry.first);
  }

  std::size_t size() const { return objects_.size(); }
  const std::map<ObjectId, std::unique_ptr<LibraryObject>>& all() const {
    visits_ += objects_.size();
    return objects_;
  }
  /// Objects and cells of the grid that were looked at by place, or handed out by all(), so far:
  /// what a frame costs must not grow with the library.
  std::uint64_t visits() const { return visits_; }

 private:
  friend struct ArchiveAccess;
  void touch(ObjectId id) {
    if (notes_touched_) touched_.insert(id);
  }
  /// Of an object that has gone.
  void touch_gone(ObjectId id);
  using Cell = std::uint64_t;
  static Cell cell_at(std::int32_t x, std::int32_t y);
  static std::vector<Cell> cells_of(const Eigen::Vector2d& low, const Eigen::Vector2d& high);
  void unfile(ObjectId id);

  std::map<ObjectId, std::unique_ptr<LibraryObject>> objects_;
  std::unordered_map<Cell, std::vector<ObjectId>> grid_;
  std::unordered_map<std::uint32_t, std::vector<Cell>> filed_;
  std::uint32_t next_id_ = 1;
  bool notes_touched_ = false;
  std::uint32_t untold_id_ = 1;  ///< no id from here on was there at the last take_touched()
  std::set<ObjectId> touched_;
  mutable std::uint64_t visits_ = 0;
};

ObjectSnapshot snapshot(const LibraryObject& object);

}  // namespace pocd

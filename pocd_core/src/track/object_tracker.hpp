// The objects that a frame is about: verdicts, beliefs, surfaces, and what becomes of each of them.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pocd/map/map_edits.hpp"
#include "pocd/objects/frame_result.hpp"
#include "pocd/observe/align_in_place.hpp"
#include "pocd/observe/free_space.hpp"
#include "pocd/observe/look.hpp"
#include "pocd/observe/parts.hpp"
#include "pocd/segmentation/planes.hpp"
#include "pocd/track/departures.hpp"
#include "pocd/track/rules.hpp"
#include "pocd/track/tracker_config.hpp"

namespace pocd {

struct IcpResult;

/// Distance [m] of a point [m, W] from the surface in the map, positive before it; nothing where
/// too few looks measured it.
using DistanceAt = std::function<std::optional<double>(const Eigen::Vector3f&)>;

/// Owns the object library. Not thread-safe.
class ObjectTracker {
 public:
  explicit ObjectTracker(const TrackerConfig& config);

  const ObjectLibrary& library() const { return library_; }

  /// Updates all beliefs from one frame; fuses, adds, moves and removes objects. `edits` gets what
  /// becomes of the voxels of objects, to be done before the frame is integrated; `distance_at`
  /// reads the map as the edits so far leave it. `owner_of_pixel` gets, per grid pixel of an
  /// observation, the object that owns the surface there, 0 where that is not decided yet.
  void update(const Frame& frame, const OrganizedCloud& cloud, const DepthField& field,
              const Observations& observations, const GroundModel& ground,
              const DistanceAt& distance_at, MapEdits& edits,
              std::vector<std::uint32_t>& owner_of_pixel, FrameResult& result);

  /// From now on stamps go on from `now_ns`, which lies before `newest_ns`, the newest so far: all
  /// that is known becomes known from just before it.
  void set_clock_back(StampNs newest_ns, StampNs now_ns);

  // What an operator says, between two frames (operator_acts.cpp).

  /// Who said what of which frame's state.
  struct Said {
    std::string by, rule;
    StampNs stamp_ns = 0;
  };
  /// Nothing is known of the object any more. For one that was reported: the event.
  void forget(ObjectId id, const Said& said, MapEdits& edits, FrameResult& result);
  /// The object is gone, as if cameras had seen it go.
  void confirm_removal(ObjectId id, const Said& said, MapEdits& edits, FrameResult& result);
  /// The event of what was said.
  void note(const Said& said, const OrientedBox& where, FrameResult& result);
  /// What was found gone, and what was seen empty there.
  void forget_places(const std::function<bool(const Eigen::Vector2d&)>& inside);

 private:
  friend struct ArchiveAccess;
  struct Step;  ///< what the parts of one update share

  // In the order of update().
  void join_sides(Step& step);
  void look_at_objects(Step& step);
  void update_beliefs(Step& step);
  void fuse_parts(Step& step);
  void join_objects(Step& step);
  void lose_surface(Step& step);
  void remove_objects(Step& step);
  void confirm_objects(Step& step);
  void report_changes(Step& step);

  /// The moment of the object that this frame belongs to, entered on the first call.
  Moment& moment_of(Step& step, LibraryObject& object);
  /// Puts the frame's measurement into the belief and into the step's evidence; false when another
  /// robot has told more of the object in this moment.
  bool measure(Step& step, Look& look, double delta_m);
  /// Whether what began then lasts for longer than a moment: looks of one moment are one.
  bool lasts(const Step& step, StampNs since_ns) const;
  double measurement_sigma(const Step& step, const LibraryObject& object) const;
  void move_displaced(Step& step, Look& look);
  void fuse(Step& step, LibraryObject& object, const std::vector<SurfacePoint>& points);
  LibraryObject& create(Step& step, ClassId class_id);
  /// What was known of the space behind the object, from its surfel `from` on, is known no more.
  void hide_space_behind(Step& step, const LibraryObject& object, std::size_t from);
  /// Sets the middle of the object's surface, and returns the box around it; nothing of no surface.
  std::optional<OrientedBox> fit(const Step& step, LibraryObject& object) const;
  void refit_box(Step& step, LibraryObject& object);
  void absorb(Step& step, LibraryObject& survivor, LibraryObject& absorbed);
  /// The object's surfels are listed elsewhere from now on.
  void forget_sights(Step& step, const LibraryObject& object);
  /// Makes one of two known objects; the older one goes on.
  void join(Step& step, LibraryObject& a, LibraryObject& b);
  /// Whether what is known of two objects allows that they are one.
  bool may_be_one(const LibraryObject& a, const LibraryObject& b) const;
  /// Whether each of two objects lies before the other one, as the walls of a corner do seen from
  /// within: a body has no such sides.
  bool form_corner(const LibraryObject& a, const LibraryObject& b) const;
  /// Of those that neither are there nor departed lately.
  void forget_gone_companions(LibraryObject& object);
  /// Whether two objects of one piece in the image are one piece of surface in the map.
  bool connected(const LibraryObject& a, const LibraryObject& b) const;
  /// Whether `high` stands within the outline of `low`, from above its middle on and not clear of
  /// its top: of one class they are one thing, as a stack or a cart and its handle. Without a class
  /// they may be two.
  bool carries(const LibraryObject& low, const LibraryObject& high) const;
  /// Whether two objects may be sides of one body, or a fragment and its body: nothing was ever
  /// seen through between them, and they are no farther apart than the larger one is long.
  bool sides_of_one(Step& step, const LibraryObject& a, const LibraryObject& b) const;
  /// Whether `known` stood in its place for long enough before `found` was first seen that the free
  /// space around it is known.
  bool surroundings_known(const LibraryObject& found, const LibraryObject& known) const;
  /// Whether two objects are one surface, known twice.
  bool coincide(const LibraryObject& a, const LibraryObject& b) const;
  /// Whether the frame's masks say that two objects are two things.
  bool seen_apart(const Step& step, ObjectId a, ObjectId b) const;
  /// The known object that a new one is another side of; or null.
  LibraryObject* whole_of(Step& step, const LibraryObject& found);
  /// The one that an object that was reported lately, and has grown since, is another side of; or
  /// null. What stood there longer is no side of what arrived.
  LibraryObject* grown_onto(Step& step, const LibraryObject& object);
  /// Takes the marked surfels out of the object and the map, and reports them as gone when they are
  /// more than an edge.
  void lose_part(Step& step, LibraryObject& object, const std::vector<std::uint8_t>& marked,
                 Rule rule);
  /// The rest of an object has told nothing yet: alpha and beta of a new one, no measurement.
  void begin_anew(Step& step, LibraryObject& object);
  /// Clears the object's voxels where `inside` says so, but for those at which this frame or
  /// another object has a surface.
  void clear_gone(Step& step, ObjectId id, MapEdits::Where inside);
  void remove(Step& step, LibraryObject& object, Rule rule);
  /// What left, and where it may be now: reported as MOVED when it is found, else as REMOVED.
  void depart(Step& step, Departure departure, Rule rule);
  void report_gone(Step& step, Departure departure, Rule rule);
  void keep(Departure departure, FrameResult& result);
  void keep(const Move& move, FrameResult& result);
  void confirm(Step& step, LibraryObject& object);
  /// Reports the object as moved when it is one that departed; false when there is none.
  bool find_origin(Step& step, LibraryObject& object);
  /// Whether a like object near by is being found gone or displaced: then the new one may be it.
  bool origin_in_doubt(const LibraryObject& object);
  /// The motion that took what departed to `found` [m, W]; nothing when they are two things.
  std::optional<Motion> motion_of(const Step& step, const Departure& departure,
                                  const LibraryObject& found) const;
  /// Whether it was asked before: a thing that was found may be larger than what was known of it,
  /// as more of it is seen.
  enum class Asked { kFirst, kAgain };
  /// All motions that may have.
  std::vector<Motion> motions_of(const Step& step, const Departure& departure,
                                 const LibraryObject& found, Asked asked) const;
  /// The one of them that did; nothing when too little is known. `arrival`: of the found one.
  static std::optional<Motion> likeliest(const std::vector<Motion>& motions,
                                         const Departure& departure, Arrival arrival);
  /// The same by one alignment of the found surface `source` with what departed, `target`; nothing
  /// when what was seen speaks against it.
  std::optional<Motion> explanation(const Step& step, const Departure& departure,
                                    const LibraryObject& found, const IcpTarget& target,
                                    const Points& source, const IcpResult& icp) const;
  bool may_tell(const Motion& motion, const Departure& departure, const LibraryObject& found,
                StampNs now_ns) const;
  /// The known or new object that is what departed, by the shortest motion; or null.
  LibraryObject* find_departed(const Step& step, const Departure& departure, Motion& motion);
  /// Moves over a distance, once what departed and what arrived are known for kFarWaitS.
  void find_far_moves(Step& step);
  void report_move(Step& step, LibraryObject& found, const Departure& from, const Pose& T_new_old,
                   Rule rule);
  /// What is known of the other sides of what departed, where the motion took them [m, W], but for
  /// those whose place was seen empty.
  std::vector<Surfel> other_sides(const Step& step, const Departure& departure,
                                  const Pose& T_new_old) const;
  /// Of things that moved, of which more was seen since: the motion is corrected, or taken back.
  void ask_moves_again(Step& step, const std::vector<ObjectId>& touched);
  /// What moved has gone another way than was told. `there`: what was measured at the new place.
  void correct(Step& step, LibraryObject& object, const ObjectModel& there, Move& move,
               const Pose& T_new_old);
  /// What is said to have moved is another thing: the one is gone, and the other one is new.
  void take_back(Step& step, LibraryObject& object, const LibraryObject& there);
  enum class Along {
    kNo,      ///< the motion does not explain what departed
    kJoined,  ///< it was a side of the thing that moved, and is of it now
    kMoved,   ///< it moved alike, and was found there
  };
  /// Whether what departed went the way that a thing near by went.
  Along went_along(Step& step, const Departure& departure, const Move& move);
  /// After a move: joins what departed and what arrived with it.
  void gather_sides(Step& step, Move move);
  void mark_changed(LibraryObject& object);
  Evidence evidence_of(const Step& step, const LibraryObject& object) const;
  /// `other`: the object that was joined with this one, for Rule::kJoined.
  ObjectEvent& add_event(Step& step, EventKind kind, const LibraryObject& object, Rule rule,
                         ObjectId other = ObjectId::kNone);
  bool seen_empty(const DistanceAt& distance_at, const Eigen::Vector3f& point_W) const;
  Arrival arrival_of(const LibraryObject& object) const;
  /// Surfaces that are no farther apart touch each other [m].
  double contact_m() const;
  /// Surfels that make a piece of surface of the least area that counts.
  std::size_t least_surfels() const;

  TrackerConfig config_;
  ObjectLibrary library_;
  FreeSpace free_space_;
  Departures departures_;
  std::deque<ObjectId> arrivals_;  ///< added, not asked yet whether they came from afar
  std::uint64_t next_event_ = 1;
  std::vector<Look> looks_;        ///< a frame uses the first ones; memory is kept between frames
  std::vector<ObjectId> changed_;  ///< since the last result
};

}  // namespace pocd

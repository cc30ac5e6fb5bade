// Steps 5 to 7 of the method for the objects that a frame is about.
#pragma once

#include <cstdint>
#include <vector>

#include "pocd/association/associate.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "pocd/map/view_memory.hpp"
#include "pocd/pipeline/frame_result.hpp"
#include "pocd/pipeline/pipeline_config.hpp"
#include "pocd/segmentation/planes.hpp"
#include "pocd/state/lifecycle.hpp"

namespace pocd {

/// Owns the object library. Not thread-safe.
class ObjectTracker {
 public:
  explicit ObjectTracker(const PipelineConfig& config) : config_(config) {}

  const ObjectLibrary& library() const { return library_; }

  /// Updates all beliefs from one frame, fuses, adds, moves and removes objects, clears the voxels
  /// of removed ones, and says in `owner_of_observation` which object each observation belongs to
  /// (IntegrationInput::kSkip for one that is not to be mapped yet).
  void update(const Frame& frame, const OrganizedCloud& cloud, const DepthField& field,
              const Observations& observations, const GroundModel& ground, TsdfMap& map,
              std::vector<std::uint32_t>& owner_of_observation, FrameResult& result);

  /// From now on stamps go on from `now_ns`, which lies before those that are kept: all that is
  /// known becomes known from just before it.
  void set_clock_back(StampNs now_ns);

 private:
  friend struct ArchiveAccess;
  struct Step;  ///< what the parts of one update share

  void find_candidates(Step& step);
  /// Notes which objects were seen in their place, and whose place was seen empty or covered.
  void note_presence(Step& step);
  void update_matched(Step& step);
  void update_unmatched(Step& step);
  void add_new(Step& step);
  void join_companions(Step& step);
  void erode(Step& step);
  void remove_or_confirm(Step& step);
  void report_changes(Step& step);

  /// The moment of the object that this frame belongs to, entered on the first call.
  Moment& moment_of(Step& step, LibraryObject& object);
  /// Puts the frame's measurement into the belief and into the step's evidence; false when another
  /// robot has told more of the object in this moment.
  bool measure(Step& step, LibraryObject& object, double delta_m, const Sighting& sighting);
  /// Standard deviation of a change that is measured at the object's distance [m].
  double measurement_sigma(const Step& step, const LibraryObject& object) const;
  /// An object that was moved or turned a little, too little to be seen through: true when it is
  /// found displaced (and moved, once that has lasted), so that the observation must not be fused
  /// as it is.
  bool shift_object(Step& step, LibraryObject& object, const Match& match,
                    const Sighting& sighting);
  void fuse(Step& step, LibraryObject& object, std::int32_t observation);
  void refit_box(Step& step, LibraryObject& object);
  /// Makes a new object the continuation of a known one: id, voxels, history.
  void take_identity(Step& step, LibraryObject& object, ObjectId id, StampNs first_seen_ns,
                     const std::set<std::string>& seen_by);
  /// Where a new object may have come from: the nearest place of a like object that was removed, or
  /// that was not seen in its place since the new one turned up.
  struct Origin {
    const RelocationMemory::Removed* removed = nullptr;  ///< valid until the next call
    LibraryObject* live = nullptr;
    double distance_m = 0.0;
  };
  std::optional<Origin> origin_of(const Step& step, LibraryObject& found);
  /// A new object (tentative or reported as ADDED) whose origin is this one; or null.
  LibraryObject* new_place_of(const Step& step, const LibraryObject& object);
  /// The known object, seen in its place, that a new one is a part of because they would overlap;
  /// or null.
  LibraryObject* part_of(const Step& step, const LibraryObject& found);
  /// An object that moved and is not seen whole since, of which a new one beside it is the rest:
  /// the two fit into the size that it had; or null.
  LibraryObject* completed_by(const LibraryObject& found);
  /// A like object in question whose place a new one takes, so that it moved there; or null.
  LibraryObject* displaced_by(const Step& step, const LibraryObject& found);
  /// A known object of another class in whose place a new one stands, so that it is gone; or null.
  LibraryObject* replaced_by(const Step& step, const LibraryObject& found);
  /// Whether a new one is seen only in part, beside a like one that may have moved.
  bool may_be_part(const Step& step, const LibraryObject& found);
  /// The first known object within reach of the new one for which `test` holds; or null.
  template <class Test>
  LibraryObject* first_known(const LibraryObject& found, double reach_m, const Test& test);
  /// Tries to explain a new object by what is known: as a part of it, or as what moved into the
  /// place of something. True when that was done; `found` may be gone then.
  bool explain(Step& step, LibraryObject& found);
  /// Joins new objects that are the rest of one that moved and is seen better now.
  void take_rest(Step& step, LibraryObject& moved);
  /// Makes `absorbed` a part of `survivor`.
  void absorb(Step& step, LibraryObject& survivor, LibraryObject& absorbed);
  /// What was reported as ADDED turns out, seen better, to be a known thing that moved.
  void link_additions(Step& step);
  /// Whether the place of an object was seen empty before the object was seen there.
  bool has_arrived(LibraryObject& object) const;
  /// A known object that grew at one end into what was empty before, while the other end was seen
  /// through, slid along itself: true after its model has been cut to its size.
  bool slide(Step& step, LibraryObject& object);
  /// The end of an object that went farther than that of an earlier box, into what was empty.
  struct GrownEnd {
    Eigen::Vector3d along_W = Eigen::Vector3d::Zero();  ///< horizontal unit vector to that end
    double half_length_m = 0.0;                         ///< of the earlier box, along it
    double grown_m = 0.0;
  };
  std::optional<GrownEnd> grown_end(const Step& step, const LibraryObject& object,
                                    const OrientedBox& then) const;
  /// Whether the box differs from the last report by more than noise.
  bool notable_change(const LibraryObject& object) const;
  /// Makes `found` the continuation of a removed object, and reports it as MOVED.
  void report_move(Step& step, LibraryObject& found, const RelocationMemory::Removed& origin,
                   const std::string& rule);
  /// Points that free space took since the last report and that did not come back.
  static std::size_t missing(const LibraryObject& object);
  /// Those are a notable share of its points.
  static bool is_eroded(const LibraryObject& object);
  /// Whether a point lies beside the box, by more than noise.
  bool beyond_sides(const OrientedBox& box, const Eigen::Vector3f& point_W) const;
  /// A good part of what is observed lies outside of a box.
  bool reaches_beyond(const Observation& observation, const OrientedBox& box) const;
  /// The box of an object when all of it was there: that of its last report while free space erodes
  /// it, else the present one.
  static const OrientedBox& known_box(const LibraryObject& object);
  /// Whether a new object may be a known one elsewhere, by its size.
  bool may_be(const Step& step, const LibraryObject& found, const OrientedBox& known) const;
  /// Whether the new object may have stood there all the time, hidden by the box of a known one.
  bool revealed_by(const Step& step, const LibraryObject& found, const OrientedBox& known) const;
  /// Whether a thing found here and the known one would overlap, so that the known one is not there
  /// any more.
  bool takes_place_of(const Step& step, const LibraryObject& found,
                      const LibraryObject& known) const;
  void mark_changed(LibraryObject& object);
  void confirm(Step& step, LibraryObject& object);
  /// Takes the object out of library and map. It is reported as MOVED when there is a successor:
  /// the given one, or what new_place_of finds.
  void remove(Step& step, ObjectId id, const std::string& rule, LibraryObject* successor = nullptr);
  /// What was measured of an object in this frame; else its belief as it is.
  static Evidence evidence_of(const Step& step, const LibraryObject& object);
  ObjectEvent& add_event(Step& step, EventKind kind, const LibraryObject& object,
                         const std::string& rule);
  double like_size_slack_m() const { return 3.0 * config_.map.voxel_size_m; }

  PipelineConfig config_;
  ObjectLibrary library_;
  RelocationMemory relocations_;
  ViewMemory views_;
  std::uint64_t next_event_ = 1;
  std::vector<Candidate>
      candidates_;                 ///< a frame uses the first ones; memory is kept between frames
  std::vector<ObjectId> changed_;  ///< since the last result
};

}  // namespace pocd

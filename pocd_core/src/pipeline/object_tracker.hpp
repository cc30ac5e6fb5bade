// Steps 5 to 7 of the method for the objects that a frame is about.
#pragma once

#include <cstdint>
#include <vector>

#include "pocd/association/associate.hpp"
#include "pocd/map/tsdf_map.hpp"
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

 private:
  struct Step;  ///< what the parts of one update share

  void find_candidates(Step& step);
  void update_matched(Step& step);
  void update_unmatched(Step& step);
  void add_new(Step& step);
  void join_companions(Step& step);
  void erode(Step& step);
  void remove_or_confirm(Step& step);
  void report_changes(Step& step);

  /// An object that was moved or turned a little, too little to be seen through: true when it is
  /// found displaced (and moved, once that has lasted), so that the observation must not be fused
  /// as it is.
  bool shift_object(Step& step, LibraryObject& object, const Match& match,
                    const Sighting& sighting);
  void fuse(Step& step, LibraryObject& object, std::int32_t observation);
  void refit_box(Step& step, LibraryObject& object);
  /// Makes a new object the continuation of a known one: id, voxels, history.
  void take_identity(Step& step, LibraryObject& object, ObjectId id, StampNs first_seen_ns);
  /// The tentative object in view that is most likely this one, moved; or null.
  LibraryObject* new_place_of(const Step& step, const LibraryObject& object);
  /// A known object of this class and size that was added since this one was last seen, or null.
  LibraryObject* added_like(const Step& step, const LibraryObject& object);
  /// What was removed and looks like this object, or null.
  const RelocationMemory::Removed* removed_like(const Step& step, const LibraryObject& object);
  /// Whether a new object may be a known one elsewhere, by its size.
  bool may_be(const LibraryObject& found, const LibraryObject& known) const;
  /// Whether another known object, not seen in its place lately, was nearer to where this one was
  /// found.
  bool has_nearer_claim(const Step& step, const LibraryObject& found, ObjectId claimant,
                        const OrientedBox& old_place) const;
  void mark_changed(LibraryObject& object);
  void confirm(Step& step, LibraryObject& object);
  void remove(Step& step, ObjectId id, const std::string& rule);
  ObjectEvent& add_event(Step& step, EventKind kind, const LibraryObject& object,
                         const std::string& rule);
  double like_size_slack_m() const { return 3.0 * config_.map.voxel_size_m; }

  PipelineConfig config_;
  ObjectLibrary library_;
  RelocationMemory relocations_;
  std::uint64_t next_event_ = 1;
  std::vector<Candidate>
      candidates_;                 ///< a frame uses the first ones; memory is kept between frames
  std::vector<ObjectId> changed_;  ///< since the last result
};

}  // namespace pocd

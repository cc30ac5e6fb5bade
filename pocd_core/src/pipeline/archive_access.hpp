// Archives of classes with private members.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "../track/object_tracker.hpp"
#include "archive_object.hpp"
#include "frame_clock.hpp"
#include "ignored_regions.hpp"
#include "looked_at.hpp"
#include "pocd/input/pose_gate.hpp"
#include "pocd/segmentation/planes.hpp"
#include "robot_notes.hpp"

namespace pocd {

/// Each description names all members: one that is added does not compile until it was decided
/// what becomes of it.
struct ArchiveAccess {
  template <class Archive>
  static void describe(Archive& a, FrameClock::Heard& heard) {
    auto& [stamp_ns, frame, off_in_a_row] = heard;
    a(stamp_ns, frame, off_in_a_row);
  }
  template <class Archive>
  static void describe(Archive& a, FrameClock& clock) {
    auto& [newest_ns, robots, frames] = clock;
    a(newest_ns, frames);
    by_robot(a, robots);
  }
  using Track = PoseGate::Track;
  template <class Archive>
  static void describe(Archive& a, Track& track) {
    auto& [accepted, accepted_ns, velocity_mps, step_s, refused, refused_ns, in_a_row] = track;
    a(accepted, accepted_ns, velocity_mps, step_s, refused, refused_ns, in_a_row);
  }
  template <class Archive>
  static void describe(Archive& a, PoseGate& gate) {
    [[maybe_unused]] auto& [config, tracks, forgotten] = gate;
    by_robot(a, tracks);
  }
  template <class Archive>
  static void describe(Archive& a, GroundModel& ground) {
    auto& [known, from_class, normal_W, offset_m, level_m, is_strip] = ground;
    a(known, from_class, normal_W, offset_m, level_m, is_strip);
  }
  template <class Archive>
  static void describe(Archive& a, Grounds& grounds) {
    auto& [robots] = grounds;
    by_robot(a, robots);
  }
  template <class Archive>
  static void describe(Archive& a, MaskWatch::Sends& sends) {
    auto& [missing_since_ns] = sends;
    a(missing_since_ns);
  }
  template <class Archive>
  static void describe(Archive& a, MaskWatch& masks) {
    auto& [robots] = masks;
    by_robot(a, robots);
  }
  template <class Archive>
  static void describe(Archive& a, IgnoredRegions& ignored) {
    auto& [by_name] = ignored;
    a(by_name);
  }
  template <class Archive>
  static void describe(Archive& a, Departures& departures) {
    auto& [list, moves] = departures;
    a(list, moves);
  }

  /// The index lists each surfel in its own cell, or in one that it crept out of.
  template <class Archive>
  static void describe(Archive& a, ObjectModel& m) {
    [[maybe_unused]] auto& [spacing_m, inverse_spacing, surfels, index] = m;
    surfels_by_planes(a, surfels);
    std::vector<std::pair<std::int32_t, std::uint64_t>> elsewhere;  // surfel, cell
    if constexpr (!Archive::kLoads) {
      bool any = false;
      for (std::size_t i = 0; i < m.surfels_.size() && !any; ++i) any = !at_home(m, i);
      if (any) {
        for (const auto& [cell, i] : m.index_) {
          if (!at_home(m, static_cast<std::size_t>(i))) elsewhere.emplace_back(i, cell);
        }
        std::sort(elsewhere.begin(), elsewhere.end());
      }
    }
    a(elsewhere);
    if constexpr (Archive::kLoads) {
      m.index_.clear();
      m.index_.reserve(m.surfels_.size());
      auto next = elsewhere.begin();
      for (std::size_t i = 0; i < m.surfels_.size(); ++i) {
        const auto number = static_cast<std::int32_t>(i);
        std::uint64_t cell = 0;
        if (next != elsewhere.end() && next->first == number) {
          cell = next++->second;
        } else {
          cell = m.cell_of(m.surfels_[i].point_W);
        }
        if (!m.index_.try_emplace(cell, number).second) a.fail("two surfels are in one cell");
      }
      if (next != elsewhere.end()) a.fail("a cell names no surfel");
    }
  }
  static bool at_home(const ObjectModel& m, std::size_t i) {
    const auto at = m.index_.find(m.cell_of(m.surfels_[i].point_W));
    return at != m.index_.end() && at->second == static_cast<std::int32_t>(i);
  }

  using FreeBlock = FreeSpace::Block;
  /// Differences along x: neighbours were seen empty about as often.
  static FreeBlock differences(const FreeBlock& block) {
    FreeBlock out = block;
    for (std::size_t i = 1; i < block.size(); ++i) {
      out[i] = static_cast<std::uint8_t>(block[i] - block[i - 1]);
    }
    return out;
  }
  static void sum_up(FreeBlock& block) {
    for (std::size_t i = 1; i < block.size(); ++i) {
      block[i] = static_cast<std::uint8_t>(block[i] + block[i - 1]);
    }
  }
  /// Null where nothing was seen.
  static const FreeBlock* free_block(const FreeSpace& space, const BlockKey& key) {
    const auto at = space.blocks_.find(key);
    return at == space.blocks_.end() ? nullptr : at->second.get();
  }
  static FreeBlock& make_free_block(FreeSpace& space, const BlockKey& key) {
    std::unique_ptr<FreeBlock>& block = space.blocks_[key];
    block = std::make_unique<FreeBlock>();
    return *block;
  }

  static StampNs& looked_ns(LookedAt& looked, const BlockKey& region) {
    [[maybe_unused]] auto& [inverse_m, last_ns, fresh, changed, on, notes_changes] = looked;
    return last_ns[region];
  }

  /// But for objects and free space, which are pieces of their own.
  template <class Archive>
  static void describe(Archive& a, ObjectTracker& tracker) {
    // Looks are of one frame, and what changed is listed with each result.
    [[maybe_unused]] auto& [config, library, free_space, departures, arrivals, next_event, looks,
                            changed] = tracker;
    [[maybe_unused]] auto& [objects, grid, filed, next_id, notes, untold, touched, visits] =
        library;
    [[maybe_unused]] auto& [cell_m, most_blocks, blocks, left_out, notes_changes, changed_blocks] =
        free_space;
    a(next_id, next_event, departures, arrivals);
  }
  static ObjectLibrary& library(ObjectTracker& t) { return t.library_; }
  static FreeSpace& free_space(ObjectTracker& t) { return t.free_space_; }
  static std::uint32_t& next_id(ObjectTracker& t) { return t.library_.next_id_; }
  static std::uint64_t& next_event(ObjectTracker& t) { return t.next_event_; }

  /// Of private structs, which argument-dependent look-up does not find.
  template <class Archive, class T>
  static void by_robot(Archive& a, std::map<std::string, T>& list) {
    const std::uint32_t n = a.count(list.size());
    if constexpr (Archive::kLoads) {
      list.clear();
      for (std::uint32_t i = 0; i < n; ++i) {
        std::string robot;
        a(robot);
        describe(a, list[robot]);
      }
    } else {
      for (auto& [robot, value] : list) {
        a(robot);
        describe(a, value);
      }
    }
  }

  /// Puts an object into a library that has none of this id.
  static void insert(ObjectLibrary& library, std::unique_ptr<LibraryObject> object) {
    LibraryObject& placed = *object;
    library.objects_[object->id] = std::move(object);
    library.place(placed, OrientedBox(placed.box));
  }
};

/// Found by argument-dependent look-up for the classes above.
template <class Archive, class T>
auto archive(Archive& a, T& v) -> decltype(ArchiveAccess::describe(a, v)) {
  ArchiveAccess::describe(a, v);
}

}  // namespace pocd

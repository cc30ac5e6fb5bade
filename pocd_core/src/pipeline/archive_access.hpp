// Archives of classes with private members.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "archive_object.hpp"
#include "../track/object_tracker.hpp"
#include "frame_clock.hpp"
#include "pocd/pipeline/pose_gate.hpp"
#include "pocd/segmentation/planes.hpp"

namespace pocd {

struct ArchiveAccess {
  template <class Archive>
  static void describe(Archive& a, FrameClock::Heard& h) {
    a(h.stamp_ns, h.frame, h.off_in_a_row);
  }
  template <class Archive>
  static void describe(Archive& a, FrameClock& c) {
    a(c.newest_ns_, c.frames_);
    by_robot(a, c.robots_);
  }
  using Track = PoseGate::Track;
  template <class Archive>
  static void describe(Archive& a, Track& t) {
    a(t.accepted, t.accepted_ns, t.velocity_mps, t.step_s, t.refused, t.refused_ns,
      t.refused_in_a_row);
  }
  template <class Archive>
  static void describe(Archive& a, PoseGate& g) {
    by_robot(a, g.tracks_);
  }
  template <class Archive>
  static void describe(Archive& a, GroundModel& g) {
    a(g.known_, g.from_class_, g.normal_W_, g.offset_m_, g.level_m_, g.is_strip_);
  }
  template <class Archive>
  static void describe(Archive& a, Departures& d) {
    a(d.list_);
  }

  /// The index lists each surfel in its own cell, or in one that it crept out of.
  template <class Archive>
  static void describe(Archive& a, ObjectModel& m) {
    a(m.surfels_);
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

  /// But for objects and free space, which are pieces of their own.
  template <class Archive>
  static void describe(Archive& a, ObjectTracker& t) {
    a(t.library_.next_id_, t.next_event_, t.departures_, t.arrivals_);
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

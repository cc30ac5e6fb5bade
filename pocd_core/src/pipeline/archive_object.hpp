// Archive of one object of the library: everything that a later frame may ask of it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "archive_basics.hpp"
#include "pocd/objects/object_library.hpp"
#include "pocd/track/departures.hpp"

namespace pocd {

// Each names all members: one that is added does not compile until it is described. Who changes
// one changes kPiecesVersion.

/// First all first bytes of the values, then all second ones, and so on, up to `size`: they are
/// alike and compress. `value_of` gives element i, to be read or set.
template <class Archive, class Value>
void by_planes(Archive& a, std::size_t count, std::size_t size, const Value& value_of) {
  std::vector<std::uint8_t> plane(count);
  for (std::size_t k = 0; k < size; ++k) {
    const auto byte = [&](std::size_t i) {
      return reinterpret_cast<std::uint8_t*>(&value_of(i)) + k;
    };
    if constexpr (!Archive::kLoads) {
      for (std::size_t i = 0; i < count; ++i) plane[i] = *byte(i);
    }
    a.section();
    a.raw(plane.data(), plane.size());
    if constexpr (Archive::kLoads) {
      for (std::size_t i = 0; i < count; ++i) *byte(i) = plane[i];
    }
  }
}

/// Many surfels were measured last by few frames: the stamps there are, ascending, and the number
/// of each surfel's among them.
template <class Archive>
void stamps_by_number(Archive& a, std::vector<Surfel>& surfels) {
  std::vector<StampNs> all;
  std::vector<std::uint32_t> numbers(surfels.size(), 0);
  if constexpr (!Archive::kLoads) {
    for (const Surfel& surfel : surfels) {  // neighbours in the list mostly have the same
      if (all.empty() || all.back() != surfel.last_hit_ns) all.push_back(surfel.last_hit_ns);
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < surfels.size(); ++i) {
      const StampNs stamp_ns = surfels[i].last_hit_ns;
      if (all[number] != stamp_ns) {
        const auto at = std::lower_bound(all.begin(), all.end(), stamp_ns);
        number = static_cast<std::uint32_t>(at - all.begin());
      }
      numbers[i] = number;
    }
  }
  a.section();
  a(all);
  std::size_t size = 1;
  while (size < sizeof(std::uint32_t) && all.size() >> (8 * size) > 0) ++size;
  by_planes(a, surfels.size(), size, [&](std::size_t i) -> std::uint32_t& { return numbers[i]; });
  if constexpr (Archive::kLoads) {
    for (std::size_t i = 0; i < surfels.size(); ++i) {
      if (numbers[i] >= all.size()) a.fail("a surfel has a stamp that is not listed");
      surfels[i].last_hit_ns = all[numbers[i]];
    }
  }
}

template <class Archive>
void surfels_by_planes(Archive& a, std::vector<Surfel>& surfels) {
  surfels.resize(a.count(surfels.size()));
  if (surfels.empty()) return;
  // All members, as below.
  [[maybe_unused]] auto& [point, normal, weight, hits, through, is_new, hit_ns] = surfels.front();
  const auto field = [&](auto Surfel::*member) {
    by_planes(
        a, surfels.size(), sizeof(surfels.front().*member), [&](std::size_t i) -> auto& {
          return surfels[i].*member;
        });
  };
  field(&Surfel::point_W);
  field(&Surfel::normal_W);
  field(&Surfel::weight);
  field(&Surfel::hits);
  field(&Surfel::seen_through);
  std::vector<std::uint8_t> arrived;
  for (const Surfel& surfel : surfels) arrived.push_back(surfel.arrived ? 1 : 0);
  a.section();
  a.raw(arrived.data(), arrived.size());
  if constexpr (Archive::kLoads) {
    for (std::size_t i = 0; i < surfels.size(); ++i) surfels[i].arrived = arrived[i] == 1;
  }
  stamps_by_number(a, surfels);
  a.section();
}

template <class Archive>
void archive(Archive& a, Moment& moment) {
  auto& [start_ns, frame_ns, robots, before, measured, observed, seen_through, points] = moment;
  a(start_ns, frame_ns, robots, before, measured, observed, seen_through, points);
}

/// But for its id, which is the key of the piece, its model, which is a piece of its own, and the
/// alignment target, which is made of the model.
template <class Archive>
void archive(Archive& a, LibraryObject& object) {
  [[maybe_unused]] auto& [id, class_id, stationarity_class, model, box, centroid_W, belief, arrival,
                          moved, first_seen_ns, last_seen_ns, in_reach_ns, visit_ns, placed_ns,
                          in_place_ns, last_robot, seen_by, moment, observations, confirmed,
                          added_ns, reported_box, changed, looks_missed, looks_unobserved,
                          unobserved_since_ns, looks_displaced, displaced_since_ns, looks_losing,
                          lost, companions, box_surfels, most_surfels, most_free, icp_target] =
      object;
  a.version(1);
  a(class_id, stationarity_class, box, centroid_W, belief, arrival, moved);
  a(first_seen_ns, last_seen_ns, in_reach_ns, visit_ns, placed_ns, in_place_ns);
  a(last_robot, seen_by, moment, observations);
  a(confirmed, added_ns, reported_box, changed, looks_missed, looks_unobserved);
  a(unobserved_since_ns, looks_displaced, displaced_since_ns, looks_losing, lost, companions);
  a(box_surfels, most_surfels, most_free);
}

template <class Archive>
void archive(Archive& a, Departure& departure) {
  auto& [id, part_of, class_id, box, surfels, first_seen_ns, in_place_ns, first_gone_ns,
         departed_ns, arrival, seen_by, evidence, asked_far, is_not] = departure;
  a(id, part_of, class_id, box);
  surfels_by_planes(a, surfels);
  a(first_seen_ns, in_place_ns, first_gone_ns, departed_ns, arrival, seen_by, evidence, asked_far);
  a(is_not);
}

template <class Archive>
void archive(Archive& a, Move& move) {
  auto& [id, class_id, from, T_new_old, in_place_ns, moved_ns, left, first_seen_there_ns,
         surfels_there] = move;
  a(id, class_id, from, T_new_old, in_place_ns, moved_ns, first_seen_there_ns, surfels_there);
  Departure departure = left ? *left : Departure{};
  a(departure);
  if constexpr (Archive::kLoads) {
    if (departure.id != ObjectId::kNone)
      left = std::make_shared<const Departure>(std::move(departure));
  }
}

}  // namespace pocd

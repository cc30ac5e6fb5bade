#include "pocd/observe/parts.hpp"

#include <algorithm>
#include <numeric>

#include "pocd/common/cell_index.hpp"

namespace pocd {
namespace {

/// An object owns what an observation shows of it from this many points on.
constexpr int kLeastShared = 5;
/// A piece has arrived when more than this share of it lies where space was seen empty before. Not
/// all of it: where a thing stood before, and near the ground, a free place is not known as one.
constexpr double kArrivedShare = 0.3;
/// Pieces of which so much of the smaller one's box lies in the other's are one.
constexpr double kOverlapShare = 0.3;
/// Points of a piece that are asked for what they touch.
constexpr std::size_t kContactBudget = 60;
constexpr int kLeastContacts = 2;

/// Connected pieces of some points of an observation, of which there is one per cell of
/// `spacing_m`: points nearer than `reach_m` belong together.
std::vector<std::vector<std::int32_t>> pieces_of(const std::vector<SurfacePoint>& points,
                                                 const std::vector<std::int32_t>& indices,
                                                 double spacing_m, double reach_m) {
  CellIndex cells;
  const float inverse = static_cast<float>(1.0 / spacing_m);
  const auto reach = static_cast<std::int64_t>(std::ceil(reach_m / spacing_m));
  const auto reach2 = static_cast<float>(reach_m * reach_m);
  std::vector<std::int32_t> parent(indices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::int32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const Eigen::Vector3f& p = points[indices[k]].point_W;
    const auto x = static_cast<std::int64_t>(std::floor(p.x() * inverse));
    const auto y = static_cast<std::int64_t>(std::floor(p.y() * inverse));
    const auto z = static_cast<std::int64_t>(std::floor(p.z() * inverse));
    for (std::int64_t dz = -reach; dz <= reach; ++dz) {
      for (std::int64_t dy = -reach; dy <= reach; ++dy) {
        for (std::int64_t dx = -reach; dx <= reach; ++dx) {
          const std::int32_t other = cells.find(cell_key(x + dx, y + dy, z + dz));
          if (other == CellIndex::kNone ||
              (points[indices[other]].point_W - p).squaredNorm() > reach2) {
            continue;
          }
          const std::int32_t a = root(other), b = root(static_cast<std::int32_t>(k));
          parent[std::max(a, b)] = std::min(a, b);
        }
      }
    }
    cells.insert(cell_key(p, inverse), static_cast<std::int32_t>(k));
  }
  std::vector<std::vector<std::int32_t>> pieces;
  std::vector<std::int32_t> number(indices.size(), -1);
  for (std::size_t k = 0; k < indices.size(); ++k) {
    std::int32_t& n = number[root(static_cast<std::int32_t>(k))];
    if (n < 0) {
      n = static_cast<std::int32_t>(pieces.size());
      pieces.emplace_back();
    }
    pieces[n].push_back(indices[k]);
  }
  return pieces;
}

class Divider {
 public:
  Divider(const Observations& observations, Look* looks, std::size_t count,
          const SeenEmpty& seen_empty, const PartsConfig& config)
      : observations_(observations),
        looks_(looks),
        count_(count),
        seen_empty_(seen_empty),
        config_(config) {}

  void divide(std::int32_t index, std::vector<Part>& parts) {
    const Observation& observation = observations_.list[index];
    find_owners(index, observation);
    std::vector<std::int32_t> rest;
    explain(index, observation, rest, parts);
    if (rest.empty()) return;
    std::vector<SurfacePoint> points = observation.points;
    for (const std::int32_t i : rest) points[i].arrived = seen_empty_(points[i].point_W);
    // One instance is one thing, whatever stands before it.
    std::vector<std::vector<std::int32_t>> pieces;
    if (observation.instance != 0) {
      pieces.push_back(rest);
    } else {
      pieces = pieces_of(points, rest, config_.spacing_m, reach_m());
      merge_overlapping(points, pieces);
    }
    for (const auto& piece : pieces) {
      std::size_t in_free = 0;
      for (const std::int32_t i : piece) in_free += points[i].arrived;
      const bool has_arrived =
          static_cast<double>(in_free) > kArrivedShare * static_cast<double>(piece.size());
      give(index, piece, has_arrived, points, parts);
    }
  }

 private:
  struct Owner {
    Look* look;
    int explained;
  };

  /// Pieces in one place are one thing: the walls and the bottom of an open container.
  void merge_overlapping(const std::vector<SurfacePoint>& points,
                         std::vector<std::vector<std::int32_t>>& pieces) const {
    const auto box_of = [&](const std::vector<std::int32_t>& piece) {
      Points at, normals;
      for (const std::int32_t i : piece) {
        at.push_back(points[i].point_W);
        normals.push_back(points[i].normal_W);
      }
      return fit_box(at, normals, 0.01);
    };
    std::vector<OrientedBox> boxes;
    for (const auto& piece : pieces) boxes.push_back(box_of(piece));
    for (std::size_t a = 0; a < pieces.size(); ++a) {
      for (std::size_t b = a + 1; b < pieces.size(); ++b) {
        if (box_overlap(boxes[a], boxes[b], 2.0 * config_.spacing_m) < kOverlapShare) continue;
        pieces[a].insert(pieces[a].end(), pieces[b].begin(), pieces[b].end());
        pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(b));
        boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(b));
        boxes[a] = box_of(pieces[a]);
        b = a;  // what is larger now may overlap others
      }
    }
  }

  double reach_m() const { return std::max(config_.contact_m, 2.0 * config_.spacing_m); }

  void find_owners(std::int32_t index, const Observation& observation) {
    owners_.clear();
    foreign_.clear();
    for (std::size_t c = 0; c < count_; ++c) {
      Look& look = looks_[c];
      // What stands of an object of which most is gone is still its surface.
      if (look.verdict == Verdict::kDisplaced ||
          (look.verdict == Verdict::kUnobserved && !look.fits)) {
        continue;
      }
      if (box_overlap(look.object->box, observation.box, 4.0 * config_.spacing_m) <= 0.0) continue;
      // Without masks nobody knows what class a thing is of.
      const bool same_class =
          look.object->class_id == observation.class_id || observation.class_id == kThing;
      const bool same_thing = observation.instance == 0 || look.observation == index ||
                              look.observation == Observations::kNone ||
                              observations_.list[look.observation].instance == 0;
      if (same_class && same_thing) {
        owners_.push_back({&look, 0});
      } else if (look.verdict == Verdict::kInPlace && !same_class) {
        foreign_.push_back(&look);
      }
    }
  }

  void explain(std::int32_t index, const Observation& observation, std::vector<std::int32_t>& rest,
               std::vector<Part>& parts) {
    const auto radius = static_cast<float>(1.5 * config_.spacing_m);
    std::vector<std::vector<std::int32_t>> own(owners_.size());
    for (std::size_t i = 0; i < observation.points.size(); ++i) {
      const Eigen::Vector3f& p = observation.points[i].point_W;
      float nearest = radius * radius * 1.01f;
      std::size_t best = owners_.size();
      for (std::size_t o = 0; o < owners_.size(); ++o) {
        const ObjectModel& model = owners_[o].look->object->model;
        const int s = model.nearest(p, radius);
        if (s == ObjectModel::kNone) continue;
        const float d = (model.surfels()[s].point_W - p).squaredNorm();
        if (d < nearest) nearest = d, best = o;
      }
      if (best < owners_.size()) {
        own[best].push_back(static_cast<std::int32_t>(i));
        continue;
      }
      // Masks err at the borders of things.
      const bool foreign = std::any_of(foreign_.begin(), foreign_.end(), [&](const Look* look) {
        return look->object->model.nearest(p, radius) != ObjectModel::kNone;
      });
      if (!foreign) rest.push_back(static_cast<std::int32_t>(i));
    }
    for (std::size_t o = 0; o < owners_.size(); ++o) {
      owners_[o].explained = static_cast<int>(own[o].size());
      if (own[o].empty()) continue;
      Part part;
      part.observation = index;
      part.look = owners_[o].look;
      part.explained = true;
      part.indices = std::move(own[o]);
      for (const std::int32_t i : part.indices) part.points.push_back(observation.points[i]);
      parts.push_back(std::move(part));
    }
  }

  /// Points of the piece that touch the object's surface.
  int contacts(const std::vector<std::int32_t>& piece, const std::vector<SurfacePoint>& points,
               const Look& look) const {
    const std::size_t step = std::max<std::size_t>(1, piece.size() / kContactBudget);
    const auto reach = static_cast<float>(reach_m());
    int count = 0;
    for (std::size_t k = 0; k < piece.size(); k += step) {
      const Eigen::Vector3f& p = points[piece[k]].point_W;
      count += is_inside(look.object->box, config_.spacing_m, p) ||
               look.object->model.nearest(p, reach) != ObjectModel::kNone;
    }
    return count;
  }

  /// Whether most of the piece lies in the box.
  bool lies_within(const std::vector<std::int32_t>& piece, const std::vector<SurfacePoint>& points,
                   const OrientedBox& box) const {
    const auto inside = std::count_if(piece.begin(), piece.end(), [&](std::int32_t i) {
      return is_inside(box, 2.0 * config_.spacing_m, points[i].point_W);
    });
    return 2 * static_cast<std::size_t>(inside) > piece.size();
  }

  void give(std::int32_t index, const std::vector<std::int32_t>& piece, bool arrived,
            const std::vector<SurfacePoint>& points, std::vector<Part>& parts) {
    Look* best = nullptr;
    int most = kLeastContacts - 1;
    bool beside_contested = false;
    for (const Owner& owner : owners_) {
      if (owner.explained < kLeastShared) continue;
      // What has no class may be a wall behind the object, unless it lies within.
      if (owner.look->object->class_id != observations_.list[index].class_id &&
          !lies_within(piece, points, owner.look->object->box)) {
        continue;
      }
      const int count = contacts(piece, points, *owner.look);
      if (count <= most) continue;
      beside_contested |= owner.look->contested;
      if (owner.look->contested || owner.look->verdict == Verdict::kUnobserved ||
          (arrived && owner.look->object->arrival != Arrival::kArrived))
        continue;
      most = count;
      best = owner.look;
    }
    if (!best && observations_.list[index].instance != 0) {
      // The masks say that it is one thing with what is known of it.
      int shared = kLeastShared - 1;
      for (const Owner& owner : owners_) {
        if (owner.explained <= shared || owner.look->contested ||
            owner.look->verdict == Verdict::kUnobserved) {
          continue;
        }
        shared = owner.explained;
        best = owner.look;
      }
    }
    // Which of two places it belongs to is open.
    if (!best && !arrived && beside_contested) return;
    if (!best && piece.size() < config_.least_points) return;
    add(index, best, piece, points, parts);
  }

  static void add(std::int32_t index, Look* look, const std::vector<std::int32_t>& piece,
                  const std::vector<SurfacePoint>& points, std::vector<Part>& parts) {
    Part part;
    part.observation = index;
    part.look = look;
    part.indices = piece;
    for (const std::int32_t i : piece) part.points.push_back(points[i]);
    parts.push_back(std::move(part));
  }

  const Observations& observations_;
  Look* looks_;
  std::size_t count_;
  const SeenEmpty& seen_empty_;
  const PartsConfig& config_;
  std::vector<Owner> owners_;
  std::vector<Look*> foreign_;
};

}  // namespace

std::vector<Part> divide(const Observations& observations, Look* looks, std::size_t count,
                         const SeenEmpty& seen_empty, const PartsConfig& config) {
  std::vector<Part> parts;
  Divider divider(observations, looks, count, seen_empty, config);
  for (std::size_t j = 0; j < observations.list.size(); ++j)
    divider.divide(static_cast<std::int32_t>(j), parts);
  return parts;
}

void paint_owners(const Observations& observations, const std::vector<Part>& parts,
                  const std::vector<ObjectId>& owners, const OrganizedCloud& cloud,
                  double spacing_m, std::vector<std::uint32_t>& owner_of_pixel) {
  struct Owners {
    std::vector<std::size_t> parts;
    std::uint32_t main = 0;
    bool one = true;
    CellIndex cells;
  };
  std::vector<Owners> all(observations.list.size());
  for (std::size_t p = 0; p < parts.size(); ++p) all[parts[p].observation].parts.push_back(p);
  const float inverse = static_cast<float>(1.0 / spacing_m);
  for (std::size_t j = 0; j < all.size(); ++j) {
    Owners& o = all[j];
    std::size_t most = 0, points = 0;
    for (const std::size_t p : o.parts) {
      points += parts[p].points.size();
      if (parts[p].points.size() > most)
        most = parts[p].points.size(), o.main = to_index(owners[p]);
    }
    o.one = points == observations.list[j].points.size() &&
            std::all_of(o.parts.begin(), o.parts.end(),
                        [&](std::size_t p) { return to_index(owners[p]) == o.main; });
    if (o.one) continue;
    for (const std::size_t p : o.parts) {
      for (const SurfacePoint& point : parts[p].points) {
        o.cells.insert(cell_key(point.point_W, inverse),
                       static_cast<std::int32_t>(to_index(owners[p])));
      }
    }
  }
  owner_of_pixel.assign(cloud.size(), 0);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::int32_t j = observations.observation_of[i];
    if (j == Observations::kNone) continue;
    const Owners& o = all[j];
    if (o.one) {
      owner_of_pixel[i] = o.main;
      continue;
    }
    const std::int32_t owner = o.cells.find(cell_key(cloud.point_W(i), inverse));
    owner_of_pixel[i] = owner == CellIndex::kNone ? 0 : static_cast<std::uint32_t>(owner);
  }
}

}  // namespace pocd

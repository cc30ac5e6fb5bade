// Object submaps with consistency checks, after Schmid, Delmerico, Schonberger, Nieto, Pollefeys,
// Siegwart, Cadena: "Panoptic Multi-TSDFs: a flexible representation for online multi-resolution
// volumetric mapping and long-term dynamic scene consistency" (ICRA 2022). Each thing that is
// segmented gets a TSDF of its own. While it is observed the submap is active; not observed for a
// while, it becomes inactive and is not fused into any more. What is seen at its place on a later
// visit decides about it as a whole: matching observations keep it (and the new submap made there
// is merged into it), conflicting ones discard it. Background is one submap whose voxels are
// averaged over.
#include <algorithm>
#include <cmath>
#include <map>

#include "naive_tsdf.hpp"
#include "perception.hpp"
#include "pocd/eval/mapping_method.hpp"

namespace pocd {
namespace {

struct Submap {
  Submap(const TsdfConfig& config, double max_weight)
      : grid(config, static_cast<float>(max_weight)) {}

  ObjectId id = ObjectId::kNone;
  ClassId class_id = 0;
  NaiveTsdf grid;
  int frames = 0, missed = 0;
  bool active = true;
  ObjectSnapshot object;
  /// Of an inactive submap: its surface and what later frames said of it (0 nothing, 1 match, 2
  /// conflict).
  Points points_W;
  std::vector<std::uint8_t> said;
};

class SubmapMethod final : public MappingMethod {
 public:
  SubmapMethod(const PipelineConfig& config, const SubmapsConfig& own)
      : config_(config),
        own_(own),
        min_weight_(static_cast<float>(own.min_weight)),
        perception_(config),
        background_(config.map, static_cast<float>(own.max_weight)) {}

  FrameResult process(const Frame& frame) override {
    FrameResult result;
    const Observations& observations = perception_.observe(frame);
    const std::vector<Submap*> owner = assign_observations(observations);
    integrate(frame, observations, owner);
    for (auto& submap : submaps_) {
      if (submap->active && submap->frames == own_.confirm_frames && submap->missed == 0 &&
          is_new(*submap)) {
        report(EventKind::kAdded, *submap, frame, result);
      }
    }
    check_inactive(frame, result);
    deactivate();
    return result;
  }

  Points surface() const override {
    Points points = background_.surface(min_weight_);
    for (const auto& submap : submaps_) {
      if (submap->frames < own_.confirm_frames) continue;
      const Points own = submap->grid.surface(min_weight_);
      points.insert(points.end(), own.begin(), own.end());
    }
    return points;
  }

  bool has_objects() const override { return true; }

  std::vector<ObjectSnapshot> objects() const override {
    std::vector<ObjectSnapshot> list;
    for (const auto& submap : submaps_) {
      if (submap->frames >= own_.confirm_frames) list.push_back(submap->object);
    }
    return list;
  }

 private:
  /// Per observation the active submap that explains it best, or a new one.
  std::vector<Submap*> assign_observations(const Observations& observations) {
    std::vector<Submap*> owner(observations.list.size(), nullptr);
    const std::size_t known = submaps_.size();
    for (std::size_t n = 0; n < observations.list.size(); ++n) {
      const Observation& observation = observations.list[n];
      double best = own_.same_thing_share;
      for (std::size_t s = 0; s < known; ++s) {
        Submap& submap = *submaps_[s];
        if (!submap.active || submap.class_id != observation.class_id) continue;
        const double share = explained_share(submap.grid, observation);
        if (share > best) best = share, owner[n] = &submap;
      }
      if (owner[n]) continue;
      submaps_.push_back(std::make_unique<Submap>(config_.map, own_.max_weight));
      owner[n] = submaps_.back().get();
      owner[n]->id = ObjectId{next_id_++};
      owner[n]->class_id = observation.class_id;
    }
    return owner;
  }

  double explained_share(const NaiveTsdf& grid, const Observation& observation) const {
    const std::size_t step = std::max<std::size_t>(1, observation.points.size() / 300);
    std::size_t looked = 0, near = 0;
    for (std::size_t i = 0; i < observation.points.size(); i += step, ++looked) {
      float distance = 1.0f;
      near += grid.distance_at(observation.points[i].point_W, 1e-6f, distance) &&
              std::abs(distance) < 0.5f;
    }
    return looked > 0 ? static_cast<double>(near) / static_cast<double>(looked) : 0.0;
  }

  void integrate(const Frame& frame, const Observations& observations,
                 const std::vector<Submap*>& owner) {
    const OrganizedCloud& cloud = perception_.cloud();
    std::vector<std::uint8_t> use(cloud.size());
    const auto paint = [&](const Submap* submap) {
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        const std::int32_t n = observations.observation_of[i];
        const Submap* there =
            n == Observations::kNone ? nullptr : owner[static_cast<std::size_t>(n)];
        const bool skip =
            cloud.kind[i] == PixelKind::kDynamic || cloud.kind[i] == PixelKind::kIgnore;
        // Elsewhere the depth still shows free space in the submap's own blocks.
        use[i] = skip ? 0 : there == submap ? NaiveTsdf::kUse : NaiveTsdf::kUpdateOnly;
      }
      return perception_.full_size_mask(frame, use);
    };
    background_.integrate(frame, paint(nullptr));
    for (const auto& submap : submaps_) {
      if (!submap->active) continue;
      ++submap->missed;
      if (std::find(owner.begin(), owner.end(), submap.get()) == owner.end()) continue;
      submap->grid.integrate(frame, paint(submap.get()));
      submap->missed = 0;
      ++submap->frames;
      if (submap->frames == own_.confirm_frames || submap->frames % 10 == 0) refresh(*submap);
    }
  }

  static void refresh(Submap& submap) {
    Points points = submap.grid.surface(0.0f);
    submap.object.id = submap.id;
    submap.object.class_id = submap.class_id;
    if (!points.empty()) submap.object.box = fit_box(points, {}, 0.005);
  }

  /// Compares inactive submaps in view with the depth image, and decides about them.
  void check_inactive(const Frame& frame, FrameResult& result) {
    const Pose T_C_W = frame.T_W_C.inverse();
    const CameraModel& camera = frame.camera;
    for (auto& submap : submaps_) {
      if (submap->active) continue;
      std::size_t match = 0, conflict = 0;
      for (std::size_t i = 0; i < submap->points_W.size(); ++i) {
        const Eigen::Vector3d p_C = T_C_W * submap->points_W[i].cast<double>();
        std::uint8_t& said = submap->said[i];
        if (p_C.z() > 0.1 && p_C.z() < config_.map.max_depth_m) {
          const auto u =
              static_cast<int>(std::floor(p_C.x() / p_C.z() * camera.fx + camera.cx + 0.5));
          const auto v =
              static_cast<int>(std::floor(p_C.y() / p_C.z() * camera.fy + camera.cy + 0.5));
          if (u >= 0 && v >= 0 && u < camera.width && v < camera.height) {
            const double depth = frame.depth_m.at<float>(v, u);
            const double margin = config_.map.voxel_size_m * own_.margin_voxels;
            if (depth > 0.0 && std::abs(depth - p_C.z()) <= margin) said = 1;
            if (depth > p_C.z() + margin) said = 2;
          }
        }
        match += said == 1, conflict += said == 2;
      }
      const auto compared = static_cast<double>(match + conflict);
      if (compared < own_.compared_share * static_cast<double>(submap->points_W.size()) ||
          compared < 10.0)
        continue;
      if (static_cast<double>(conflict) > own_.conflict_share * compared) {
        report(EventKind::kRemoved, *submap, frame, result);
        submap->frames = 0;
      }
    }
    drop_discarded();
  }

  void drop_discarded() {
    submaps_.erase(std::remove_if(submaps_.begin(), submaps_.end(),
                                  [&](const auto& s) {
                                    return !s->active && s->frames < own_.confirm_frames;
                                  }),
                   submaps_.end());
  }

  void deactivate() {
    for (auto& submap : submaps_) {
      if (!submap->active || submap->missed <= own_.inactive_after_frames) continue;
      submap->active = false;
      if (submap->frames < own_.confirm_frames) continue;
      refresh(*submap);
      submap->points_W = submap->grid.surface(min_weight_);
      if (Submap* older = consistent_older(*submap)) {
        older->grid.merge(submap->grid);
        refresh(*older);
        older->points_W = older->grid.surface(min_weight_);
        older->said.assign(older->points_W.size(), 0);
        submap->frames = 0;
      } else {
        submap->said.assign(submap->points_W.size(), 0);
      }
    }
    drop_discarded();
  }

  /// Whether no inactive submap of an earlier visit stands in this place.
  bool is_new(Submap& submap) const {
    submap.points_W = submap.grid.surface(0.0f);
    return consistent_older(submap) == nullptr;
  }

  /// The inactive submap of the class that agrees with most of this one's surface.
  Submap* consistent_older(const Submap& submap) const {
    Submap* best = nullptr;
    double best_share = own_.match_share;
    for (const auto& other : submaps_) {
      if (other->active || other.get() == &submap || other->class_id != submap.class_id ||
          other->frames < own_.confirm_frames) {
        continue;
      }
      std::size_t known = 0, near = 0;
      for (const Eigen::Vector3f& point : submap.points_W) {
        float distance = 1.0f;
        if (!other->grid.distance_at(point, min_weight_, distance)) continue;
        ++known;
        near += std::abs(distance) < 0.5f;
      }
      const bool enough = static_cast<double>(known) >=
                          own_.compared_share * static_cast<double>(submap.points_W.size());
      const double share =
          known > 0 && enough ? static_cast<double>(near) / static_cast<double>(known) : 0.0;
      if (share > best_share) best_share = share, best = other.get();
    }
    return best;
  }

  void report(EventKind kind, const Submap& submap, const Frame& frame, FrameResult& result) {
    ObjectEvent event;
    event.sequence = next_event_++;
    event.kind = kind;
    event.object = submap.id;
    event.class_id = submap.class_id;
    event.stamp_ns = frame.stamp_ns;
    event.frame_sequence = frame.sequence;
    event.box = submap.object.box;
    event.evidence.rule = kind == EventKind::kAdded ? "confirmed" : "conflict";
    result.events.push_back(std::move(event));
  }

  PipelineConfig config_;
  SubmapsConfig own_;
  float min_weight_;
  Perception perception_;
  NaiveTsdf background_;
  std::vector<std::unique_ptr<Submap>> submaps_;
  std::uint32_t next_id_ = 1;
  std::uint64_t next_event_ = 1;
};

}  // namespace

std::unique_ptr<MappingMethod> make_submap_method(const PipelineConfig& config,
                                                  const SubmapsConfig& own) {
  return std::make_unique<SubmapMethod>(config, own);
}

}  // namespace pocd

// Tracked dynamic objects, after Runz, Buffier, Agapito: "MaskFusion: real-time recognition,
// tracking and reconstruction of multiple moving objects" (ISMAR 2018). Things of movable classes
// are never part of the static map; each has a model of its own that is tracked by ICP from frame
// to frame and fused into. A model that is not found for a while is given up, as there (its models
// are deactivated after ten frames out of view); keep_lost leaves it where it was seen last, and
// takes it up again when it is found there.
#include <algorithm>

#include "naive_tsdf.hpp"
#include "perception.hpp"
#include "pocd/eval/assignment.hpp"
#include "pocd/eval/mapping_method.hpp"
#include "pocd/objects/object_model.hpp"
#include "pocd/registration/point_to_plane_icp.hpp"

namespace pocd {
namespace {

struct Track {
  ObjectId id = ObjectId::kNone;
  ClassId class_id = 0;
  ObjectModel model;
  OrientedBox box;
  int missed = 0;
};

class TrackedObjectsMethod final : public MappingMethod {
 public:
  TrackedObjectsMethod(const PipelineConfig& config, const TrackedObjectsConfig& own)
      : config_(config),
        own_(own),
        perception_(config),
        background_(config.map, static_cast<float>(own.max_weight)) {}

  FrameResult process(const Frame& frame) override {
    const Observations& observations = perception_.observe(frame);
    integrate_background(frame, observations);
    std::vector<std::size_t> movable;
    for (std::size_t i = 0; i < observations.list.size(); ++i) {
      if (is_movable(observations.list[i].class_id)) movable.push_back(i);
    }
    track(observations, movable);
    return {};
  }

  Points surface() const override {
    Points points = background_.surface(static_cast<float>(own_.min_weight));
    for (const Track& track : tracks_) {
      for (const Surfel& surfel : track.model.surfels()) {
        if (surfel.hits >= own_.min_hits) points.push_back(surfel.point_W);
      }
    }
    return points;
  }

 private:
  bool is_movable(ClassId id) const {
    return config_.classes.role(id) == ClassRole::kObject &&
           config_.classes.stationarity_class(id) == 0;
  }

  void integrate_background(const Frame& frame, const Observations& observations) {
    const OrganizedCloud& cloud = perception_.cloud();
    std::vector<std::uint8_t> use(cloud.size(), NaiveTsdf::kUse);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const std::int32_t n = observations.observation_of[i];
      const bool foreground = n != Observations::kNone && is_movable(observations.list[n].class_id);
      if (foreground || is_movable(cloud.label[i]) || cloud.kind[i] == PixelKind::kDynamic ||
          cloud.kind[i] == PixelKind::kIgnore) {
        use[i] = 0;
      }
    }
    background_.integrate(frame, perception_.full_size_mask(frame, use));
  }

  void track(const Observations& observations, const std::vector<std::size_t>& movable) {
    const auto radius_m = static_cast<float>(config_.map.voxel_size_m);
    std::vector<AssignmentCandidate> pairs;
    std::vector<Pose> motion(tracks_.size() * movable.size(), Pose::Identity());
    for (std::size_t t = 0; t < tracks_.size(); ++t) {
      for (std::size_t m = 0; m < movable.size(); ++m) {
        const Observation& observation = observations.list[movable[m]];
        if (tracks_[t].class_id != observation.class_id) continue;
        Pose& T_new_old = motion[t * movable.size() + m];
        double share = tracks_[t].model.explained_share(observation.points, radius_m, 300);
        const bool near =
            (tracks_[t].box.pose.position_W - observation.box.pose.position_W).norm() <
            config_.association.max_distance_m;
        if (share < 1.0 - config_.association.max_dissimilarity && near &&
            tracks_[t].missed < own_.lost_after_frames) {
          const double aligned = align(tracks_[t], observation, T_new_old);
          if (aligned > share) {
            share = aligned;
          } else {
            T_new_old = Pose::Identity();
          }
        }
        if (share > own_.overlap_share)
          pairs.push_back({static_cast<int>(t), static_cast<int>(m), 1.0 - share});
      }
    }
    for (Track& track : tracks_) ++track.missed;
    std::vector<bool> used(movable.size(), false);
    for (const AssignedPair& pair : assign(pairs, 1.0)) {
      const auto t = static_cast<std::size_t>(pair.row), m = static_cast<std::size_t>(pair.column);
      const Pose& T_new_old = motion[t * movable.size() + m];
      if (!T_new_old.isApprox(Pose::Identity(), 1e-9)) tracks_[t].model.transform(T_new_old);
      fuse(tracks_[t], observations.list[movable[m]]);
      used[m] = true;
    }
    for (std::size_t m = 0; m < movable.size(); ++m) {
      if (used[m]) continue;
      tracks_.push_back({ObjectId{next_id_++},
                         observations.list[movable[m]].class_id,
                         ObjectModel(config_.map.voxel_size_m),
                         {},
                         0});
      fuse(tracks_.back(), observations.list[movable[m]]);
    }
    if (own_.keep_lost) return;
    tracks_.erase(
        std::remove_if(tracks_.begin(), tracks_.end(),
                       [&](const Track& track) { return track.missed > own_.lost_after_frames; }),
        tracks_.end());
  }

  /// Aligns the model with the observation; returns the share of the observation that then fits.
  double align(const Track& track, const Observation& observation, Pose& T_new_old) const {
    Points points, normals, source;
    for (const Surfel& surfel : track.model.surfels()) {
      points.push_back(surfel.point_W);
      normals.push_back(surfel.normal_W);
    }
    const std::size_t step = std::max<std::size_t>(1, observation.points.size() / 300);
    for (std::size_t i = 0; i < observation.points.size(); i += step) {
      source.push_back(observation.points[i].point_W);
    }
    const IcpTarget target(points, normals, 1.5 * config_.map.voxel_size_m,
                           config_.association.icp_max_distance_m);
    IcpOptions options;
    options.max_iterations = config_.association.icp_iterations;
    const IcpResult result = point_to_plane_icp(target, source, options);
    T_new_old = result.T_target_source.inverse();
    return 1.0 - result.dissimilarity;
  }

  void fuse(Track& track, const Observation& observation) {
    track.model.fuse(observation.points, ++looks_);
    track.missed = 0;
    Points points;
    for (const Surfel& surfel : track.model.surfels()) points.push_back(surfel.point_W);
    track.box = fit_box(points, {}, 0.005);
  }

  PipelineConfig config_;
  TrackedObjectsConfig own_;
  Perception perception_;
  NaiveTsdf background_;
  std::vector<Track> tracks_;
  std::uint32_t next_id_ = 1;
  StampNs looks_ = 0;  ///< what the models count looks by
};

}  // namespace

std::unique_ptr<MappingMethod> make_tracked_objects_method(const PipelineConfig& config,
                                                           const TrackedObjectsConfig& own) {
  return std::make_unique<TrackedObjectsMethod>(config, own);
}

}  // namespace pocd

#include "pocd/eval/published_method.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "perception.hpp"
#include "pocd/belief/bayesian_update.hpp"
#include "pocd/eval/assignment.hpp"
#include "pocd/eval/ray_traced_change.hpp"
#include "pocd/eval/surface_points.hpp"
#include "pocd/objects/object_model.hpp"
#include "pocd/registration/point_to_plane_icp.hpp"
#include "pocd/track/rules.hpp"

namespace pocd {
namespace {

/// Nearer points have no place in an image.
constexpr double kNearestDepth_m = 0.1;

struct Thing {
  explicit Thing(double spacing_m) : model(spacing_m) {}

  ObjectSnapshot object;
  ObjectModel model;
  std::shared_ptr<const IcpTarget> target;  ///< of the model; null when the model has changed
};

/// How an object would have to move to lie where the observation does.
struct Alignment {
  double translation_m = 0.0;
  double translation_z_C_m = 0.0;  ///< in the optical frame
};

Points points_of(const Observation& observation) {
  Points points;
  points.reserve(observation.points.size());
  for (const SurfacePoint& p : observation.points) points.push_back(p.point_W);
  return points;
}

/// The update, and what it was made of. Not applied when it would raise E[v] above v_max.
Evidence update_belief(Belief& belief, double delta_m, int stationarity_class,
                       const PublishedConfig& config) {
  Evidence evidence;
  evidence.delta_m = std::clamp(delta_m, -config.delta_max_m, config.delta_max_m);
  evidence.stationarity_class = stationarity_class;
  evidence.measurement_sigma_m = config.tau_m;
  evidence.before = belief;
  Measurement measurement{evidence.delta_m, stationarity_class, config.tau_m, 0.0};
  measurement.k = adaptive_k(belief, measurement, config.delta_max_m, config.k);
  const UpdateResult update = bayesian_update(belief, measurement, config.delta_max_m);
  evidence.k = measurement.k;
  evidence.c1 = update.c1;
  evidence.c2 = update.c2;
  const double before = belief.stationarity(), after = update.belief.stationarity();
  if (after <= config.max_stationarity || after <= before)
    belief = clamp_counts(update.belief, config.max_count);
  evidence.after = belief;
  return evidence;
}

class PublishedMethod final : public MappingMethod {
 public:
  PublishedMethod(const PipelineConfig& config, const PublishedConfig& own)
      : config_(config), own_(own), perception_(config), pool_(1), map_(config.map) {}

  FrameResult process(const Frame& frame) override {
    FrameResult result;
    Observations observations = perception_.observe(frame);
    merge_overlapping_observations(config_.map.voxel_size_m, observations);
    owners_.assign(observations.list.size(), IntegrationInput::kSkip);
    std::vector<bool> observed(things_.size(), false), assigned(observations.list.size(), false);
    for (const auto& [pair, alignment] : associate(frame, observations)) {
      const auto thing = static_cast<std::size_t>(pair.row);
      const auto index = static_cast<std::size_t>(pair.column);
      observed[thing] = assigned[index] = true;
      verify(frame, observations.list[index], alignment, *things_[thing], owners_[index]);
    }
    for (std::size_t i = 0; i < things_.size(); ++i) {
      Thing& thing = *things_[i];
      if (observed[i] || frustum_share(frame, thing) < own_.min_frustum_share) continue;
      evidence_[thing.object.id] = update_belief(thing.object.belief, own_.delta_max_m,
                                                 thing.object.stationarity_class, own_);
    }
    erase_gone(frame, result);
    for (std::size_t j = 0; j < observations.list.size(); ++j) {
      if (!assigned[j]) owners_[j] = add(frame, observations.list[j], result);
    }
    integrate(frame, observations);
    for (const auto& thing : things_) {
      if (evidence_.count(thing->object.id)) result.changed_objects.push_back(thing->object);
    }
    evidence_.clear();
    return result;
  }

  Points surface() const override { return surface_points(map_, config_.map.min_publish_weight); }
  bool has_objects() const override { return true; }
  std::vector<ObjectSnapshot> objects() const override {
    std::vector<ObjectSnapshot> list;
    for (const auto& thing : things_) list.push_back(thing->object);
    return list;
  }

 private:
  using Pairing = std::pair<AssignedPair, Alignment>;

  /// Step 4: ICP over all pairs within the gate, then the optimal assignment.
  std::vector<Pairing> associate(const Frame& frame, const Observations& observations) {
    std::vector<AssignmentCandidate> candidates;
    std::map<std::pair<int, int>, Alignment> alignments;
    for (std::size_t j = 0; j < observations.list.size(); ++j) {
      const Observation& observation = observations.list[j];
      const Points source = icp_source(observation);
      for (std::size_t i = 0; i < things_.size(); ++i) {
        Thing& thing = *things_[i];
        const Eigen::Vector3d centre_W = thing.object.box.pose.position_W;
        if ((centre_W - observation.box.pose.position_W).norm() >= own_.max_distance_m) continue;
        IcpOptions options;
        options.max_iterations = own_.icp_iterations;
        const IcpResult icp = point_to_plane_icp(target_of(thing), source, options);
        if (icp.dissimilarity > own_.max_dissimilarity) continue;
        const Pose T_new_old = icp.T_target_source.inverse();
        const Eigen::Vector3d moved_W = T_new_old * centre_W - centre_W;
        const double cost =
            published_cost(moved_W.norm(), Eigen::AngleAxisd(T_new_old.linear()).angle(),
                           thing.object.class_id == observation.class_id, own_);
        if (cost > own_.cutoff_cost) continue;
        const int row = static_cast<int>(i), column = static_cast<int>(j);
        candidates.push_back({row, column, cost});
        alignments[{row, column}] = {moved_W.norm(),
                                     (frame.T_W_C.linear().transpose() * moved_W).z()};
      }
    }
    std::vector<Pairing> pairs;
    for (const AssignedPair& pair : assign(candidates, own_.cutoff_cost)) {
      pairs.emplace_back(pair, alignments.at({pair.row, pair.column}));
    }
    return pairs;
  }

  /// Steps 5 and 6 of an update-pending object. Owner of the observation's pixels: the object, or
  /// kSkip when the observation is discarded.
  void verify(const Frame& frame, const Observation& observation, const Alignment& alignment,
              Thing& thing, std::uint32_t& owner) {
    const double delta_m = geometric_change(frame, observation, alignment, thing);
    const Evidence evidence =
        update_belief(thing.object.belief, delta_m, thing.object.stationarity_class, own_);
    evidence_[thing.object.id] = evidence;
    if (std::abs(evidence.delta_m) > 0.5 * own_.tau_m) return;
    fuse(frame, observation, thing);
    owner = to_index(thing.object.id);
  }

  double geometric_change(const Frame& frame, const Observation& observation,
                          const Alignment& alignment, const Thing& thing) const {
    const Eigen::Isometry3f T_C_W = frame.T_W_C.inverse().cast<float>();
    Points object_C, observation_C;
    for (const Surfel& s : thing.model.surfels()) object_C.push_back(T_C_W * s.point_W);
    for (const SurfacePoint& p : observation.points) observation_C.push_back(T_C_W * p.point_W);
    RayTracedChangeOptions options;
    options.voxel_size_m = config_.map.voxel_size_m;
    options.truncation_m = std::max(own_.tsdf_truncation_m, options.voxel_size_m);
    options.lambda_diff = own_.lambda_diff;
    const auto change =
        ray_traced_change(object_C, observation_C, alignment.translation_z_C_m, options);
    if (change) return change->delta_m;
    return alignment.translation_z_C_m < 0.0 ? alignment.translation_m : -alignment.translation_m;
  }

  /// Share of the object's points in the frustum, whatever stands before them.
  double frustum_share(const Frame& frame, const Thing& thing) const {
    const OrientedBox& box = thing.object.box;
    const double reach_m = config_.map.max_depth_m;
    const Pose T_C_W = frame.T_W_C.inverse();
    const double middle_m = (T_C_W * box.pose.position_W).z(), radius_m = 0.5 * box.size_m.norm();
    if (middle_m < -radius_m || middle_m > reach_m + radius_m) return 0.0;
    std::size_t inside = 0;
    for (const Surfel& s : thing.model.surfels()) {
      const Eigen::Vector3d p_C = T_C_W * s.point_W.cast<double>();
      if (p_C.z() < kNearestDepth_m || p_C.z() > reach_m) continue;
      const double u = frame.camera.fx * p_C.x() / p_C.z() + frame.camera.cx;
      const double v = frame.camera.fy * p_C.y() / p_C.z() + frame.camera.cy;
      inside +=
          u >= -0.5 && v >= -0.5 && u < frame.camera.width - 0.5 && v < frame.camera.height - 0.5;
    }
    return static_cast<double>(inside) / static_cast<double>(thing.model.surfels().size());
  }

  /// Step 7: the objects below theta_stat leave library and map.
  void erase_gone(const Frame& frame, FrameResult& result) {
    const auto is_gone = [this](const Thing& thing) {
      return thing.object.belief.stationarity() < own_.remove_below;
    };
    for (const auto& thing : things_) {
      if (!is_gone(*thing)) continue;
      const ObjectId id = thing->object.id;
      map_.clear_object(id);
      std::replace(owners_.begin(), owners_.end(), to_index(id), IntegrationInput::kSkip);
      result.retired.push_back(id);
      report(EventKind::kRemoved, rule_text(Rule::kStationarityBelowThreshold), frame, *thing,
             result);
    }
    things_.erase(std::remove_if(things_.begin(), things_.end(),
                                 [&](const auto& thing) { return is_gone(*thing); }),
                  things_.end());
  }

  std::uint32_t add(const Frame& frame, const Observation& observation, FrameResult& result) {
    auto thing = std::make_unique<Thing>(config_.map.voxel_size_m);
    ObjectSnapshot& object = thing->object;
    object.id = ObjectId{next_id_++};
    object.class_id = observation.class_id;
    object.stationarity_class = config_.classes.stationarity_class(observation.class_id);
    object.belief.sigma = own_.initial_sigma_m;
    object.belief.alpha = own_.initial_stationarity * own_.initial_count;
    object.belief.beta = (1.0 - own_.initial_stationarity) * own_.initial_count;
    object.first_seen_ns = frame.stamp_ns;
    fuse(frame, observation, *thing);
    Evidence& evidence = evidence_[object.id];
    evidence.stationarity_class = object.stationarity_class;
    evidence.before = evidence.after = object.belief;
    report(EventKind::kAdded, "new_object", frame, *thing, result);
    things_.push_back(std::move(thing));
    return to_index(things_.back()->object.id);
  }

  void fuse(const Frame& frame, const Observation& observation, Thing& thing) {
    thing.model.fuse(observation.points, frame.stamp_ns);
    thing.target.reset();
    Points points;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Surfel& s : thing.model.surfels()) {
      points.push_back(s.point_W);
      sum += s.point_W.cast<double>();
    }
    ObjectSnapshot& object = thing.object;
    object.box = fit_box_pca(points);
    object.centroid_W = sum / static_cast<double>(points.size());
    object.last_seen_ns = frame.stamp_ns;
    object.last_robot = frame.robot;
    ++object.observations;
    auto& robots = object.seen_by;
    const auto at = std::lower_bound(robots.begin(), robots.end(), frame.robot);
    if (!frame.robot.empty() && (at == robots.end() || *at != frame.robot))
      robots.insert(at, frame.robot);
  }

  const IcpTarget& target_of(Thing& thing) const {
    if (!thing.target) {
      Points points, normals;
      for (const Surfel& s : thing.model.surfels()) {
        points.push_back(s.point_W);
        normals.push_back(s.normal_W);
      }
      const double inlier_m = 1.5 * config_.map.voxel_size_m;
      thing.target = std::make_shared<IcpTarget>(points, normals, inlier_m,
                                                 std::max(inlier_m, own_.icp_max_distance_m));
    }
    return *thing.target;
  }

  Points icp_source(const Observation& observation) const {
    Points source;
    const std::size_t step = std::max<std::size_t>(1, observation.points.size() / own_.icp_points);
    for (std::size_t i = 0; i < observation.points.size(); i += step)
      source.push_back(observation.points[i].point_W);
    return source;
  }

  void integrate(const Frame& frame, const Observations& observations) {
    const OrganizedCloud& cloud = perception_.cloud();
    std::vector<std::uint32_t> owner_of_pixel(cloud.size(), 0);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const std::int32_t j = observations.observation_of[i];
      if (j != Observations::kNone) owner_of_pixel[i] = owners_[j];
      if (cloud.kind[i] == PixelKind::kDynamic || cloud.kind[i] == PixelKind::kIgnore)
        owner_of_pixel[i] = IntegrationInput::kSkip;
    }
    IntegrationInput input;
    input.frame = &frame;
    input.owners = owner_of_pixel.data();
    input.owner_width = cloud.width;
    input.owner_height = cloud.height;
    input.owner_stride = cloud.stride;
    map_.integrate(input, pool_);
  }

  void report(EventKind kind, const std::string& rule, const Frame& frame, const Thing& thing,
              FrameResult& result) {
    ObjectEvent event;
    event.sequence = next_event_++;
    event.kind = kind;
    event.object = thing.object.id;
    event.class_id = thing.object.class_id;
    event.stamp_ns = frame.stamp_ns;
    event.frame_sequence = frame.sequence;
    event.robot = frame.robot;
    event.box = thing.object.box;
    event.evidence = evidence_.at(thing.object.id);
    event.evidence.rule = rule;
    result.events.push_back(std::move(event));
  }

  PipelineConfig config_;
  PublishedConfig own_;
  Perception perception_;
  ThreadPool pool_;
  TsdfMap map_;
  std::vector<std::unique_ptr<Thing>> things_;  ///< by id
  std::uint32_t next_id_ = 1;
  std::uint64_t next_event_ = 1;
  // Of the frame.
  std::vector<std::uint32_t> owners_;  ///< per observation
  std::map<ObjectId, Evidence> evidence_;
};

}  // namespace

double published_cost(double translation_m, double rotation_rad, bool same_class,
                      const PublishedConfig& config) {
  return config.lambda_translation * translation_m + config.lambda_rotation * rotation_rad +
         (same_class ? 0.0 : config.lambda_class);
}

void merge_overlapping_observations(double min_size_m, Observations& observations) {
  std::vector<Observation>& list = observations.list;
  for (Observation& o : list) o.box = fit_box_pca(points_of(o));
  std::vector<std::size_t> merged_into(list.size());
  std::iota(merged_into.begin(), merged_into.end(), 0u);
  std::vector<std::map<ClassId, int>> votes(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) votes[i][list[i].class_id] = list[i].pixels;
  for (bool again = true; again;) {
    again = false;
    for (std::size_t a = 0; a < list.size(); ++a) {
      for (std::size_t b = a + 1; b < list.size() && merged_into[a] == a; ++b) {
        if (merged_into[b] != b) continue;
        if (box_overlap(list[a].box, list[b].box, min_size_m) <= 0.0) continue;
        merged_into[b] = a;
        list[a].points.insert(list[a].points.end(), list[b].points.begin(), list[b].points.end());
        list[a].pixels += list[b].pixels;
        list[a].area_m2 += list[b].area_m2;
        list[a].box = fit_box_pca(points_of(list[a]));
        for (const auto& [id, pixels] : votes[b]) votes[a][id] += pixels;
        again = true;
      }
    }
  }
  // Roots keep their order; a root has a smaller index than what was merged into it.
  std::vector<std::int32_t> new_index(list.size());
  std::vector<Observation> kept;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (merged_into[i] != i) {
      new_index[i] = new_index[merged_into[i]];
      continue;
    }
    new_index[i] = static_cast<std::int32_t>(kept.size());
    const auto most = std::max_element(votes[i].begin(), votes[i].end(),
                                       [](auto& x, auto& y) { return x.second < y.second; });
    list[i].class_id = most->first;
    kept.push_back(std::move(list[i]));
  }
  list = std::move(kept);
  for (std::int32_t& index : observations.observation_of) {
    if (index != Observations::kNone) index = new_index[index];
  }
}

std::unique_ptr<MappingMethod> make_published_method(const PipelineConfig& config,
                                                     const PublishedConfig& own) {
  return std::make_unique<PublishedMethod>(config, own);
}

}  // namespace pocd

// A camera that looks at a room, segmentation behind it, and the tracker of objects alone: tests
// may change what segmentation made of a frame, and when frames come.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "../../../pocd_core/src/track/object_tracker.hpp"
#include "pocd/map/tsdf_map.hpp"
#include "test_room.hpp"

namespace pocd::test {

class TrackerRig {
 public:
  explicit TrackerRig(const PipelineConfig& config = room_config())
      : config_(config),
        tracker_(TrackerConfig{config.depth_noise, config.classes, config.segmentation,
                               config.association, config.change, config.state, config.map}),
        map_(config.map) {}

  using Edit = std::function<void(Segmented&)>;

  /// One frame `after_s` after the last one.
  FrameResult look(const Scene& scene, const Edit& edit = {}, double after_s = kPeriod_s) {
    now_s_ += after_s;
    Frame frame = shoot(scene, eye, count_++);
    frame.stamp_ns = static_cast<StampNs>(now_s_ * 1e9);
    frame.robot = robot;
    add_noise(frame, config_.depth_noise, 3);
    if (holes) holes(frame);
    Segmented s = segment(frame, config_, ground_);
    if (edit) edit(s);
    field_.update(s.cloud);
    FrameResult result;
    MapEdits edits;
    const auto distance_at = [&](const Eigen::Vector3f& point_W) {
      return map_.distance_at(point_W, FreeSpace::kLooks, edits);
    };
    tracker_.update(frame, s.cloud, field_, s.observations, ground_, distance_at, edits, owners_,
                    result);
    edits.apply_to(map_);
    IntegrationInput input;
    input.frame = &frame;
    input.owners = owners_.data();
    input.owner_width = s.cloud.width;
    input.owner_height = s.cloud.height;
    input.owner_stride = s.cloud.stride;
    map_.integrate(input, pool_);
    for (const ObjectId id : result.retired) published_.erase(id);
    for (const ObjectSnapshot& o : result.changed_objects) published_.insert(o.id);
    events.insert(events.end(), result.events.begin(), result.events.end());
    return result;
  }
  void look_times(int times, const Scene& scene, const Edit& edit = {},
                  double after_s = kPeriod_s) {
    for (int i = 0; i < times; ++i) look(scene, edit, after_s);
  }

  /// All objects of a class, candidates too, by id.
  std::vector<const LibraryObject*> of_class(ClassId class_id) const {
    std::vector<const LibraryObject*> list;
    for (const auto& [id, object] : tracker_.library().all()) {
      if (object->class_id == class_id) list.push_back(object.get());
    }
    return list;
  }
  /// What a subscriber holds, and what it has to hold.
  const std::set<ObjectId>& published() const { return published_; }
  std::set<ObjectId> confirmed() const {
    std::set<ObjectId> ids;
    for (const auto& [id, object] : tracker_.library().all()) {
      if (object->confirmed) ids.insert(id);
    }
    return ids;
  }
  std::size_t count(EventKind kind) const {
    return static_cast<std::size_t>(std::count_if(
        events.begin(), events.end(), [&](const ObjectEvent& e) { return e.kind == kind; }));
  }
  std::string told() const {
    std::string out;
    for (const ObjectEvent& e : events) {
      out += std::string(to_string(e.kind)) + " " + std::to_string(to_index(e.object)) + " by " +
             e.evidence.rule + "\n";
    }
    return out;
  }
  TsdfMap& map() { return map_; }

  static constexpr double kPeriod_s = 1.0 / 15.0;
  Pose eye = look_from({0.0, 0.0, 1.0});
  std::string robot;                  ///< whose frames they are
  std::function<void(Frame&)> holes;  ///< damages each frame's depth
  std::vector<ObjectEvent> events;

 private:
  PipelineConfig config_;
  ObjectTracker tracker_;
  TsdfMap map_;
  GroundModel ground_;
  DepthField field_;
  ThreadPool pool_{1};
  std::vector<std::uint32_t> owners_;
  std::set<ObjectId> published_;
  double now_s_ = 1.0;
  std::uint64_t count_ = 0;
};

inline void refit(Observation& observation) {
  Points points, normals;
  for (const SurfacePoint& p : observation.points) {
    points.push_back(p.point_W);
    normals.push_back(p.normal_W);
  }
  observation.box = fit_box(points, normals, 0.005);
}

/// Cuts every observation of the class in two where x is `at_m` [m, W]; what is left of it gets the
/// first instance, the rest the second one.
inline void cut(Segmented& s, ClassId class_id, float at_m, std::uint16_t left = 0,
                std::uint16_t right = 0) {
  auto& list = s.observations.list;
  const std::size_t count = list.size();
  for (std::size_t k = 0; k < count; ++k) {
    if (list[k].class_id != class_id) continue;
    Observation rest = list[k];
    const auto is_left = [&](const SurfacePoint& p) { return p.point_W.x() < at_m; };
    rest.points.erase(std::remove_if(rest.points.begin(), rest.points.end(), is_left),
                      rest.points.end());
    auto& points = list[k].points;
    points.erase(std::remove_if(points.begin(), points.end(),
                                [&](const SurfacePoint& p) { return !is_left(p); }),
                 points.end());
    if (rest.points.empty() || points.empty()) {
      list[k].instance = points.empty() ? right : left;
      if (points.empty()) points = rest.points;
      continue;
    }
    list[k].instance = left;
    rest.instance = right;
    refit(list[k]);
    refit(rest);
    const auto number = static_cast<std::int32_t>(list.size());
    for (std::size_t i = 0; i < s.cloud.size(); ++i) {
      auto& of = s.observations.observation_of[i];
      if (of == static_cast<std::int32_t>(k) && s.cloud.point_W(i).x() >= at_m) of = number;
    }
    list.push_back(std::move(rest));
  }
}

}  // namespace pocd::test

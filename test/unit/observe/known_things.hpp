// A library of what some frames showed, and what another frame says about it.
#pragma once

#include <algorithm>
#include <vector>

#include "pocd/observe/look.hpp"
#include "test_room.hpp"

namespace pocd::test {

class KnownThings {
 public:
  /// Makes one object of this thing alone in the room, seen in noisy frames by a camera that sways.
  LibraryObject& learn(const SceneObject& thing, int frames = 12) {
    LibraryObject& object = library.create(config.map.voxel_size_m);
    object.class_id = thing.class_id;
    object.confirmed = true;
    object.arrival = Arrival::kFound;
    for (int i = 0; i < frames; ++i) {
      const Segmented s =
          segmented(room_with({thing}), swaying_camera(static_cast<std::uint64_t>(3 * i)));
      for (const Observation& o : s.observations.list) {
        if (o.class_id == thing.class_id) object.model.fuse(o.points, i + 1);
      }
      ++object.observations;
    }
    Points points, normals;
    for (const Surfel& surfel : object.model.surfels()) {
      if (surfel.hits < std::min(2, frames)) continue;
      points.push_back(surfel.point_W);
      normals.push_back(surfel.normal_W);
    }
    library.place(object, fit_box(points, normals, 0.005));
    return object;
  }

  /// What a frame of the scene says about all objects; displaced ones are aligned.
  const std::vector<Look>& look(const Scene& scene, const Pose& T_W_C) {
    now = segmented(scene, T_W_C);
    DepthField field;
    field.update(now.cloud);
    looks.clear();
    for (const auto& [id, object] : library.all()) {
      looks.emplace_back();
      looks.back().object = object.get();
      judge(now.cloud, field, now.observations, sight(), config.depth_noise, looks.back());
    }
    for (Look& l : looks) {
      align(now.cloud, field, now.observations, sight(), config.depth_noise, config.association,
            least_m(), looks.data(), looks.size(), l);
    }
    return looks;
  }
  const Look& look_at_only(const Scene& scene, const Pose& T_W_C) { return look(scene, T_W_C)[0]; }
  const Look& look_at_only(const Scene& scene) { return look(scene, eye)[0]; }

  SightConfig sight() const {
    return {config.map.voxel_size_m, config.change.pose_tolerance_m, config.map.max_depth_m,
            config.association.icp_max_distance_m};
  }
  double least_m() const { return 0.6 * sight().margin_m; }

  Segmented segmented(const Scene& scene, const Pose& T_W_C) {
    Frame frame = shoot(scene, T_W_C, frame_count_++);
    add_noise(frame, config.depth_noise, seed);
    return segment(frame, config);
  }

  std::uint64_t seed = 7;
  PipelineConfig config = room_config();
  Pose eye = look_from({0.1, 0, 1.0});
  ObjectLibrary library;
  Segmented now;
  std::vector<Look> looks;

 private:
  std::uint64_t frame_count_ = 0;
};

}  // namespace pocd::test

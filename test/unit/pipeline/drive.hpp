// A camera that sways before a room, the pipeline behind it, and what it said.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "pocd/pipeline/pocd_pipeline.hpp"
#include "test_room.hpp"

namespace pocd::test {

class Drive {
 public:
  explicit Drive(const PipelineConfig& config = room_config())
      : config_(config), pipeline_(config) {}

  /// Next frame of the drive, with noise, of this scene.
  Frame next_frame(const Scene& scene) {
    Frame frame = shoot(scene, swaying_camera(count_), count_);
    add_noise(frame, config_.depth_noise, 3);
    ++count_;
    return frame;
  }

  FrameResult process(const Frame& frame) {
    FrameResult result = pipeline_.process_frame(frame);
    events_.insert(events_.end(), result.events.begin(), result.events.end());
    return result;
  }

  void watch(const Scene& scene, int frames) {
    for (int i = 0; i < frames; ++i) process(next_frame(scene));
  }

  /// Watches until there is an event of this kind; the number of frames it took, or -1.
  int watch_for(EventKind kind, const Scene& scene, int frames) {
    const std::size_t before = of_kind(kind).size();
    for (int i = 1; i <= frames; ++i) {
      process(next_frame(scene));
      if (of_kind(kind).size() > before) return i;
    }
    return -1;
  }

  std::vector<ObjectEvent> of_kind(EventKind kind) const {
    std::vector<ObjectEvent> list;
    std::copy_if(events_.begin(), events_.end(), std::back_inserter(list),
                 [&](const ObjectEvent& e) { return e.kind == kind; });
    return list;
  }

  /// The confirmed object nearest to a place, if any lies within 0.4 m (seen from above).
  std::optional<ObjectSnapshot> object_at(double x, double y) const {
    std::optional<ObjectSnapshot> best;
    double best_m = 0.4;
    for (const ObjectSnapshot& o : pipeline_.objects()) {
      const double d = (o.box.pose.position_W.head<2>() - Eigen::Vector2d(x, y)).norm();
      if (d < best_m) best_m = d, best = o;
    }
    return best;
  }

  std::size_t voxels_of(ObjectId id) const {
    std::size_t count = 0;
    for_each_voxel([&](const Eigen::Vector3d&, std::int16_t, std::uint16_t, std::uint32_t owner) {
      count += owner == to_index(id);
    });
    return count;
  }

  /// Known voxels at or behind a surface whose centres lie in this box of the map frame.
  std::size_t solid_voxels_in(const Eigen::Vector3d& low_W, const Eigen::Vector3d& high_W) const {
    std::size_t count = 0;
    for_each_voxel(
        [&](const Eigen::Vector3d& p, std::int16_t tsdf, std::uint16_t weight, std::uint32_t) {
          count += weight > 0 && tsdf <= 0 && (p.array() > low_W.array()).all() &&
                   (p.array() < high_W.array()).all();
        });
    return count;
  }

  PocdPipeline& pipeline() { return pipeline_; }
  const std::vector<ObjectEvent>& events() const { return events_; }
  std::uint64_t frames() const { return count_; }

 private:
  template <class Visit>
  void for_each_voxel(const Visit& visit) const {
    const TsdfMap& map = pipeline_.map();
    for (const BlockKey& key : map.sorted_keys()) {
      const VoxelBlock& block = *map.find(key);
      for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
        const Eigen::Vector3d index(8 * key.x + i % 8, 8 * key.y + i / 8 % 8, 8 * key.z + i / 64);
        visit((index.array() + 0.5) * config_.map.voxel_size_m, block.tsdf[i], block.weight[i],
              block.owner[i]);
      }
    }
  }

  PipelineConfig config_;
  PocdPipeline pipeline_;
  std::vector<ObjectEvent> events_;
  std::uint64_t count_ = 0;
};

inline const Eigen::Vector3d kSize(0.6, 0.4, 0.6);
inline constexpr int kLearn = 25;  // frames: more than half of the sway, so that sides are seen
/// Within a second of a camera at 15 Hz a change in full view must be reported.
inline constexpr int kPromptly = 15;

inline SceneObject left_box() { return solid(kBoxClass, {-0.6, 2.3}, kSize); }
inline SceneObject right_cage() { return solid(kCageClass, {0.7, 2.4}, {0.5, 0.5, 0.8}, 0.3); }

/// Drawn as a class of its own; masks_of_instances() says that it is a box.
inline constexpr ClassId kSecondBox = 50;

/// The frame with masks of instances (classes.label_divisor is 100): boxes are 1, and those that
/// are drawn as kSecondBox are 2, or without a number as all else when `told_apart` is false.
inline Frame masks_of_instances(Frame frame, bool told_apart = true) {
  frame.labels = frame.labels.clone();
  for (int row = 0; row < frame.labels.rows; ++row) {
    for (int col = 0; col < frame.labels.cols; ++col) {
      auto& label = frame.labels.at<std::uint16_t>(row, col);
      const int instance = label == kBoxClass ? 1 : label == kSecondBox ? 2 : 0;
      const int thing = instance > 0 ? kBoxClass : label;
      label = static_cast<std::uint16_t>(100 * thing + (told_apart ? instance : 0));
    }
  }
  return frame;
}

/// For messages of failed expectations.
inline std::string text(const std::vector<ObjectEvent>& events) {
  std::string out;
  for (const ObjectEvent& e : events) {
    out += std::string(to_string(e.kind)) + " " + std::to_string(to_index(e.object)) +
           " in frame " + std::to_string(e.frame_sequence) + " by " + e.evidence.rule + "\n";
  }
  return out;
}

}  // namespace pocd::test

// What a frame looks at does not grow with the map around it. Counted, not timed.
#include <gtest/gtest.h>

#include "pocd/map/map_delta.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "test_room.hpp"

namespace pocd::test {
namespace {

constexpr double kPitch_m = 25.6;

/// One more drive past the same things, at another place of the world.
class Halls {
 public:
  Halls() : pipeline_(room_config()) {
    const Scene scene = room_with({solid(kBoxClass, {-0.8, 2.2}, {0.6, 0.6, 0.7}),
                                   solid(kBoxClass, {0.5, 2.6}, {0.7, 0.5, 1.1}),
                                   solid(kCageClass, {1.3, 1.9}, {0.5, 0.5, 0.9})});
    for (std::uint64_t i = 0; i < 8; ++i) {
      frames_.push_back(shoot(scene, swaying_camera(5 * i), i));
      add_noise(frames_.back(), room_config().depth_noise, 3);
    }
  }

  void drive(int x, int y) {
    for (Frame frame : frames_) {
      frame.stamp_ns += static_cast<StampNs>(++drives_) * 1'000'000'000;
      frame.robot = "robot" + std::to_string(x) + "_" + std::to_string(y);
      frame.T_W_C.translation() += Eigen::Vector3d(kPitch_m * x, kPitch_m * y, 0.0);
      pipeline_.process_frame(frame);
      if (const auto delta = publisher_.update(pipeline_.map())) tiles_ += delta->changed.size();
    }
  }

  struct Work {
    std::uint64_t objects, regions, blocks, tiles;
  };
  /// Of one drive through the first hall.
  Work work() {
    const Work before = total();
    drive(0, 0);
    const Work after = total();
    return {after.objects - before.objects, after.regions - before.regions,
            after.blocks - before.blocks, after.tiles - before.tiles};
  }
  PocdPipeline& pipeline() { return pipeline_; }

 private:
  Work total() const {
    const MapVisits map = pipeline_.map().visits();
    return {pipeline_.object_visits(), map.regions, map.blocks, tiles_};
  }

  PocdPipeline pipeline_;
  MapPublisher publisher_{1, room_config().map};
  std::vector<Frame> frames_;
  int drives_ = 0;
  std::uint64_t tiles_ = 0;
};

// Little may differ because the second drive in the small map follows the first at once: noise
// decides about a few blocks.
constexpr double kSlack = 1.1;

TEST(FrameWork, DoesNotGrowWithTheMap) {
  Halls small, large;
  small.drive(0, 0);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) large.drive(x, y);
  }
  ASSERT_GE(small.pipeline().objects().size(), 3u);
  ASSERT_GE(large.pipeline().objects().size(), 24 * 3u);
  ASSERT_GE(large.pipeline().map().block_count(), 20 * small.pipeline().map().block_count());
  const Halls::Work one = small.work(), many = large.work();
  EXPECT_GT(one.objects, 0u);
  EXPECT_GT(one.tiles, 0u);
  EXPECT_LE(static_cast<double>(many.objects), kSlack * static_cast<double>(one.objects));
  EXPECT_LE(static_cast<double>(many.regions), kSlack * static_cast<double>(one.regions));
  EXPECT_LE(static_cast<double>(many.blocks), kSlack * static_cast<double>(one.blocks));
  EXPECT_LE(static_cast<double>(many.tiles), kSlack * static_cast<double>(one.tiles));
}

}  // namespace
}  // namespace pocd::test

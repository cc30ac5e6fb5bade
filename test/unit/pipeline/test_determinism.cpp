// The same frames give the same bytes, whatever the number of threads.
#include <gtest/gtest.h>

#include "drive.hpp"
#include "pocd/map/map_delta.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;
using test::room_with;
using test::solid;

struct Outcome {
  std::string digest;
  std::vector<ObjectEvent> events;
  std::vector<ObjectSnapshot> objects;
};

Outcome run(int threads) {
  PipelineConfig config = test::room_config();
  config.threads = threads;
  test::Drive drive(config);
  const SceneObject box = solid(kBoxClass, {-0.6, 2.3}, {0.6, 0.4, 0.6});
  const SceneObject cage = solid(kCageClass, {0.7, 2.4}, {0.5, 0.5, 0.8}, 0.3);
  drive.watch(room_with({box, cage}), 20);
  drive.watch(room_with({cage}), 12);
  drive.watch(room_with({solid(kCageClass, {0.3, 2.1}, {0.5, 0.5, 0.8}, 0.3)}), 12);
  MapPublisher publisher(1, config.map);
  publisher.update(drive.pipeline().map());
  return {publisher.digest().hex(), drive.events(), drive.pipeline().objects()};
}

TEST(PipelineDeterminism, SameBytesForEveryThreadCountAndEveryRun) {
  const Outcome one = run(1);
  ASSERT_GE(one.events.size(), 4u);
  for (const int threads : {1, 2, 3}) {
    const Outcome other = run(threads);
    EXPECT_EQ(other.digest, one.digest) << threads;
    ASSERT_EQ(other.events.size(), one.events.size()) << threads;
    for (std::size_t i = 0; i < one.events.size(); ++i) {
      EXPECT_EQ(other.events[i].object, one.events[i].object);
      EXPECT_EQ(other.events[i].kind, one.events[i].kind);
      EXPECT_EQ(other.events[i].frame_sequence, one.events[i].frame_sequence);
      EXPECT_EQ(other.events[i].box.pose.position_W, one.events[i].box.pose.position_W);
      EXPECT_EQ(other.events[i].evidence.after.alpha, one.events[i].evidence.after.alpha);
      EXPECT_EQ(other.events[i].evidence.rule, one.events[i].evidence.rule);
    }
    ASSERT_EQ(other.objects.size(), one.objects.size());
    for (std::size_t i = 0; i < one.objects.size(); ++i) {
      EXPECT_EQ(other.objects[i].id, one.objects[i].id);
      EXPECT_EQ(other.objects[i].box.size_m, one.objects[i].box.size_m);
      EXPECT_EQ(other.objects[i].belief.mu, one.objects[i].belief.mu);
    }
  }
}

}  // namespace
}  // namespace pocd

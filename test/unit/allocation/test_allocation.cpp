// In the steady state a frame asks for memory a few times per object, not per pixel, point or
// voxel: the number of allocations is the same for images and maps of several times the resolution.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "pocd/pipeline/pocd_pipeline.hpp"
#include "test_room.hpp"

namespace {

std::atomic<std::size_t> allocations{0};

void* counted(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* counted(std::size_t size, std::align_val_t align) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  const auto unit = static_cast<std::size_t>(align);
  if (void* memory = std::aligned_alloc(unit, (size + unit - 1) / unit * unit)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void* operator new(std::size_t size, std::align_val_t align) { return counted(size, align); }
void* operator new[](std::size_t size, std::align_val_t align) { return counted(size, align); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace pocd {
namespace {

constexpr std::size_t kFrames = 8;

/// Frames of a camera that sways before three boxes, at `scale` times the room camera's resolution.
std::vector<Frame> frames_at(int scale) {
  const Scene scene =
      test::room_with({test::solid(test::kBoxClass, {-0.9, 2.2}, {0.5, 0.4, 0.6}),
                       test::solid(test::kBoxClass, {0.1, 2.5}, {0.4, 0.4, 0.8}, 0.3),
                       test::solid(test::kCageClass, {0.9, 2.3}, {0.4, 0.5, 1.0}, -0.2)});
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < kFrames; ++i) {
    Frame frame;
    frame.camera = test::room_camera();
    frame.camera.width *= scale;
    frame.camera.height *= scale;
    frame.camera.fx *= scale;
    frame.camera.fy *= scale;
    frame.camera.cx = 0.5 * (frame.camera.width - 1);
    frame.camera.cy = 0.5 * (frame.camera.height - 1);
    frame.T_W_C = test::swaying_camera(5 * i);
    const RenderedFrame picture = render(scene, frame.camera, frame.T_W_C, false);
    frame.depth_m = picture.depth_m;
    frame.labels = picture.labels;
    frames.push_back(frame);
  }
  return frames;
}

struct Counted {
  std::size_t most = 0;  ///< allocations of one frame
  std::size_t objects = 0;
};

/// The drive is repeated until everything has been seen often; then a round is counted.
Counted count_steady(int scale, double voxel_size_m) {
  PipelineConfig config = test::room_config();
  config.map.voxel_size_m = voxel_size_m;
  PocdPipeline pipeline(config);
  std::vector<Frame> frames = frames_at(scale);
  Counted counted;
  constexpr int kRounds = 16;
  std::uint64_t sequence = 0;
  for (int round = 0; round < kRounds; ++round) {
    for (Frame& frame : frames) {
      frame.sequence = sequence;
      frame.stamp_ns = 1'000'000'000 + static_cast<StampNs>(sequence++) * 66'666'667;
      const std::size_t before = allocations;
      static_cast<void>(pipeline.process_frame(frame));
      const std::size_t asked = allocations - before;
      if (round + 1 == kRounds) counted.most = std::max(counted.most, asked);
    }
  }
  counted.objects = pipeline.objects().size();
  return counted;
}

TEST(Allocation, SteadyStateDoesNotGrowWithPixelsPointsOrVoxels) {
  const Counted coarse = count_steady(1, 0.05);
  const Counted fine = count_steady(2, 0.025);  // 4 times the pixels and points, 8 times the voxels
  RecordProperty("coarse", static_cast<int>(coarse.most));
  RecordProperty("fine", static_cast<int>(fine.most));
  ASSERT_EQ(coarse.objects, 3u);
  ASSERT_EQ(fine.objects, 3u);
  std::cout << "allocations of one frame: " << coarse.most << ", at the finer resolution "
            << fine.most << "\n";
  // A frame makes its result, its events' evidence and some lists per object, plane and stage;
  // lists whose length is not known double a few times more. What grew with points would add
  // thousands.
  EXPECT_LE(coarse.most, 400u);
  EXPECT_LE(fine.most, coarse.most + 60u);
}

}  // namespace
}  // namespace pocd

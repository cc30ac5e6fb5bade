// Things come and go for months, and nobody looks in between: what is kept of it does not grow.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <numeric>

#include "drive.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::room_with;
using test::solid;

/// What a memory would hold of the pipeline.
class Kept {
 public:
  explicit Kept(PocdPipeline& pipeline) : pipeline_(pipeline) {}
  void take() {
    for (const Piece& piece : pipeline_.take_changed_pieces()) {
      auto& bytes = bytes_[static_cast<std::size_t>(piece.kind)];
      if (piece.bytes.empty()) {
        bytes.erase(piece.key);
      } else {
        bytes[piece.key] = piece.bytes.size();
      }
    }
  }
  std::size_t count(PieceKind kind) const { return of(kind).size(); }
  std::size_t bytes(PieceKind kind) const {
    return std::accumulate(of(kind).begin(), of(kind).end(), std::size_t{0},
                           [](std::size_t sum, const auto& piece) { return sum + piece.second; });
  }

 private:
  using Sizes = std::map<std::uint64_t, std::size_t>;
  const Sizes& of(PieceKind kind) const { return bytes_[static_cast<std::size_t>(kind)]; }
  PocdPipeline& pipeline_;
  std::array<Sizes, kPieceKinds> bytes_;
};

// A box stands for all of the time. Each hour the robot comes by, and another box is put beside it,
// under another name, and carried off.
TEST(Months, WhatComesAndGoesLeavesNothingBehind) {
  const PipelineConfig config = test::room_config();
  PocdPipeline pipeline(config);
  pipeline.note_looks();
  Kept kept(pipeline);
  std::uint64_t count = 0;
  std::size_t removed = 0, rounds = 0;
  const auto watch = [&](const Scene& scene, int frames) {
    for (int i = 0; i < frames; ++i, ++count) {
      Frame frame = test::shoot(scene, test::swaying_camera(count), count);
      test::add_noise(frame, config.depth_noise, 11);
      frame.stamp_ns += static_cast<StampNs>(rounds) * 3'600'000'000'000;
      for (const ObjectEvent& e : pipeline.process_frame(frame).events)
        removed += e.kind == EventKind::kRemoved;
    }
  };
  const SceneObject stays = solid(kBoxClass, {-0.5, 2.3}, {0.5, 0.4, 0.7});
  const SceneObject comes = solid(kBoxClass, {0.4, 2.2}, {0.5, 0.4, 0.5});
  const auto round = [&] {
    ++rounds;
    watch(room_with({stays}), 20);
    watch(room_with({stays, comes}), 20);
    watch(room_with({stays}), 20);
    kept.take();
  };
  for (int i = 0; i < 3; ++i) round();
  const std::size_t objects = kept.count(PieceKind::kObject);
  const std::size_t object_bytes = kept.bytes(PieceKind::kObject);
  const std::size_t surface_bytes = kept.bytes(PieceKind::kSurface);
  const std::size_t part_bytes = kept.bytes(PieceKind::kPart);
  const std::size_t blocks = kept.count(PieceKind::kFreeSpace);
  const std::size_t regions = kept.count(PieceKind::kRegion);
  ASSERT_EQ(pipeline.objects().size(), 1u);
  for (int i = 0; i < 6; ++i) round();
  EXPECT_EQ(removed, rounds) << "it was there each time";
  EXPECT_EQ(pipeline.objects().size(), 1u);
  EXPECT_EQ(kept.count(PieceKind::kObject), objects) << "candidates are left over";
  EXPECT_EQ(kept.bytes(PieceKind::kObject), object_bytes);
  EXPECT_EQ(kept.count(PieceKind::kRegion), regions);
  EXPECT_LE(kept.count(PieceKind::kFreeSpace), blocks + blocks / 20);
  // Surfels come to be in all cells that noise reaches; of the last departure they vary.
  EXPECT_LE(kept.bytes(PieceKind::kSurface), surface_bytes + surface_bytes / 4);
  EXPECT_LE(kept.bytes(PieceKind::kPart), part_bytes + part_bytes / 4);
}

}  // namespace
}  // namespace pocd

// The pieces of a pipeline: made of what changed, and put together again.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pocd/pipeline/pipeline_pieces.hpp"

namespace pocd {

class FrameClock;
class Grounds;
class IgnoredRegions;
class LookedAt;
class MaskWatch;
class ObjectTracker;
class PoseGate;

/// The parts of a pipeline that frames change, but for the map.
struct PipelineParts {
  FrameClock& clock;
  PoseGate& gate;
  Grounds& grounds;
  MaskWatch& masks;
  IgnoredRegions& ignored;
  LookedAt& looked_at;
  ObjectTracker& tracker;
};

/// Not thread-safe.
class PipelineArchive {
 public:
  /// Pieces that are not what they were at the last call; at the first call, all there are.
  std::vector<Piece> take_changed(const PipelineParts& parts);
  /// For parts that no frame has changed yet. Throws InputError for a piece that is none, or a set
  /// that lacks a part.
  void restore(const PipelineParts& parts, const std::vector<Piece>& pieces, double spacing_m);

 private:
  /// Adds the piece unless it is as it was.
  void add(PieceKind kind, std::uint64_t key, std::vector<std::uint8_t> bytes,
           std::vector<Piece>& out, std::vector<std::size_t> sections = {});

  std::map<std::pair<PieceKind, std::uint64_t>, std::uint64_t> hash_of_;  ///< as last given
};

}  // namespace pocd

// Regions of the map that nobody has looked at since the publisher was started.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "pocd_dds/map_mirror.hpp"
#include "view/board.hpp"

namespace pocd::view {

/// Not thread-safe.
class Looks {
 public:
  explicit Looks(Board& board) : board_(board) {}
  /// Puts what has changed on the board, by sectors of 8^3 regions; a region is a chunk of the
  /// page. Returns how many were not looked at.
  std::size_t tell(const std::vector<MirrorRegion>& regions);

 private:
  Board& board_;
  std::map<ChunkKey, std::string> told_;  // by sector
};

}  // namespace pocd::view

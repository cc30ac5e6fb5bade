// What recordings hold of a map, objects and robots, for the page without a bus.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "view/board.hpp"
#include "view/robots.hpp"
#include "view/source.hpp"

namespace pocd::view {

struct RecordedOptions {
  std::vector<std::filesystem::path> inputs;  ///< one run, in this order
  std::uint32_t map_id = 0;
  std::string map_frame = "map";
  RobotTopics robots;  ///< as on the bus
};

/// Reads all of it once, with a thread of its own, as fast as it can, and puts what there is at the
/// end on the board; the time line has the rest. Thread-safe.
class Recorded : public Source {
 public:
  /// `board` must outlive it. Throws InputError when a recording cannot be read at all, or when
  /// none holds a map or objects.
  Recorded(const RecordedOptions& options, Board& board);
  ~Recorded() override;
  Recorded(const Recorded&) = delete;
  Recorded& operator=(const Recorded&) = delete;

  std::optional<std::string> history(const std::string& uuid) const override;
  std::string then(double stamp_s) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::view

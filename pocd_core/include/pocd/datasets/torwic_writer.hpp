// Writes frames in the layout that the TorWIC reader reads: simulator runs for other programs.
#pragma once

#include <filesystem>
#include <fstream>

#include "pocd/input/frame.hpp"

namespace pocd {

/// Makes `folder` with RGB/, Depth/, Segmentation/ and poses.txt. Depth is rounded to millimetres
/// (above 65.534 m: no return). Not thread-safe.
class TorwicWriter {
 public:
  /// Throws InputError when the folder cannot be made. T_B_C: camera in the robot's base frame.
  TorwicWriter(const std::filesystem::path& folder, const Pose& T_B_C);

  /// Throws InputError when a file cannot be written. Colour and labels may be absent.
  void write(const Frame& frame);

 private:
  std::filesystem::path folder_;
  Pose T_C_B_;
  std::ofstream poses_;
  int next_ = 0;
};

}  // namespace pocd

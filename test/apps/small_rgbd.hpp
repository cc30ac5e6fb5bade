// A tiny RGB-D folder: a camera that looks along +x at a wall with a box in front of it.
#pragma once

#include <cstdio>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "run_command.hpp"

namespace pocd {

inline std::filesystem::path frame_file(const std::filesystem::path& folder, int index,
                                        const std::string& ending) {
  char name[32];
  std::snprintf(name, sizeof(name), "frame-%06d", index);
  return folder / (name + ending);
}

/// Frames of 80x60 pixels, 1 m above the floor, each 1 cm nearer than the one before.
inline void write_small_rgbd(const std::filesystem::path& folder, int frames) {
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "camera-intrinsics.txt") << "60 0 40\n0 60 30\n0 0 1\n";
  for (int i = 0; i < frames; ++i) {
    const int nearer_mm = 10 * i;
    cv::Mat depth(60, 80, CV_16UC1, cv::Scalar(2000 - nearer_mm));
    depth(cv::Rect(30, 20, 20, 20)).setTo(1200 - nearer_mm);
    cv::imwrite(frame_file(folder, i, ".depth.png").string(), depth);
    cv::imwrite(frame_file(folder, i, ".color.png").string(),
                cv::Mat(60, 80, CV_8UC3, cv::Scalar(60, 120, 180)));
    std::ofstream(frame_file(folder, i, ".pose.txt"))
        << "0 0 1 " << 0.01 * i << "\n-1 0 0 0\n0 -1 0 1\n0 0 0 1\n";
  }
}

}  // namespace pocd

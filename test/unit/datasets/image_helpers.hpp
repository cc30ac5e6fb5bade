// Small images for data sets that tests make.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "pocd/datasets/open_dataset.hpp"

namespace pocd {

inline void write_image(const std::filesystem::path& file, const cv::Mat& image) {
  std::filesystem::create_directories(file.parent_path());
  cv::imwrite(file.string(), image);
}

/// 16-bit depth whose pixel (u, v) is 1000 + 10 u + v millimetres.
inline cv::Mat ramp_depth(int width = 32, int height = 24) {
  cv::Mat depth(height, width, CV_16UC1);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      depth.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(1000 + 10 * u + v);
    }
  }
  return depth;
}

inline void truncate(const std::filesystem::path& file) {
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
}

inline std::vector<Frame> read_all(DatasetReader& reader) {
  std::vector<Frame> frames;
  while (auto frame = reader.next()) frames.push_back(*frame);
  return frames;
}

inline DatasetOptions dataset_options(DatasetFormat format, const std::filesystem::path& folder,
                                      double frame_rate_hz) {
  DatasetOptions options;
  options.format = format;
  options.inputs = {folder};
  options.frame_rate_hz = frame_rate_hz;
  return options;
}

/// What open_dataset complains about, "" for nothing.
inline std::string open_error(const DatasetOptions& options) {
  try {
    open_dataset(options);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace pocd

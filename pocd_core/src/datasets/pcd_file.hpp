// The part of reading labelled PCD files that needs PCL.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

namespace pocd {

struct PcdImages {
  cv::Mat depth_m;     ///< CV_32FC1, the z field; 0 where invalid or label is 0
  cv::Mat raw_labels;  ///< CV_32SC1 of the field label (or labels) as in the file, or empty
  cv::Mat color;       ///< CV_8UC3 BGR, or empty
  /// Without labels: a field whose name says that it may be meant as such; "" when there is none.
  std::string unread_labels;
};

/// Throws InputError naming the file: unreadable, shorter than its header says, not organised, or
/// without float fields x y z.
PcdImages read_pcd(const std::filesystem::path& file);

}  // namespace pocd

// sensor_msgs/CompressedImage as ROS's image_transport_plugins write it.
#pragma once

#include <opencv2/core/mat.hpp>

#include "pocd/input/message_checks.hpp"

namespace pocd {

struct Picture {
  cv::Mat pixels;  ///< CV_8UC1, CV_16UC1, CV_8UC3 (BGR) or CV_8UC4 (BGRA)
  bool lossy = false;
};

/// PNG or JPEG, told by its first bytes.
Checked<Picture> decode_picture(const ImageView& image);

/// compressedDepth: 12 bytes (the kind of quantisation, two parameters), then PNG or RVL. 16UC1
/// holds the values, 32FC1 inverse depth: metres = a / (value - b), 0 being no return. Without
/// "compressedDepth" in the format: a PNG of 16 bits. RVL: Wilson, "Fast lossless depth image
/// compression", ISS 2017.
Checked<cv::Mat> decode_depth(const ImageView& image);

}  // namespace pocd

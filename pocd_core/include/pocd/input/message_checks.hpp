// From the fields of image, camera info and transform messages to what the synchroniser takes, with
// every check. The bus and recordings both come through here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string_view>

#include "pocd/input/camera_model.hpp"
#include "pocd/input/input_problem.hpp"
#include "pocd/input/transform_tree.hpp"
#include "pocd/input/class_map.hpp"

namespace pocd {

/// Fields of sensor_msgs/Image; views into the message.
struct ImageView {
  std::uint32_t width = 0, height = 0;
  std::string_view encoding;
  bool is_bigendian = false;
  std::uint32_t step = 0;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

/// 16UC1 and mono16 (millimetres) as CV_16UC1, 32FC1 (metres) as CV_32FC1; a copy.
Checked<cv::Mat> depth_image(const ImageView& image);
/// rgb8 and bgr8 as CV_8UC3 BGR; a copy.
Checked<cv::Mat> color_image(const ImageView& image);

/// Colours of a class map, for masks that are coloured.
class ColourTable {
 public:
  /// Throws InputError naming the class whose rgb is not "r,g,b" with values in 0 to 255, or is
  /// taken.
  explicit ColourTable(const ClassMap& classes);
  /// Pixel value of the label image; -1 for a colour of no class.
  int value(std::uint8_t r, std::uint8_t g, std::uint8_t b) const;

 private:
  std::map<std::uint32_t, int> values_;
};

struct LabelImage {
  cv::Mat labels;                    ///< CV_16UC1
  std::uint64_t unknown_pixels = 0;  ///< colours of no class: they became class 0
};
/// mono8, mono16 (also 8UC1, 16UC1): class indices. rgb8, bgr8: by colour. A copy.
Checked<LabelImage> label_image(const ImageView& image, const ColourTable& colours);

/// `k` is the row-major intrinsic matrix of a camera info.
Checked<CameraModel> camera_model(std::uint32_t width, std::uint32_t height,
                                  const std::array<double, 9>& k);

/// Names are there, values finite, the quaternion a unit one; one that is off a little is
/// corrected.
Checked<StampedTransform> checked_transform(StampedTransform transform);

}  // namespace pocd

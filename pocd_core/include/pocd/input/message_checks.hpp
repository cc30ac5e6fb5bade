// From the fields of image, camera info and transform messages to what the synchroniser takes, with
// every check. The bus and recordings both come through here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pocd/input/camera_model.hpp"
#include "pocd/input/class_map.hpp"
#include "pocd/input/input_problem.hpp"
#include "pocd/input/transform_tree.hpp"

namespace pocd {

/// Fields of sensor_msgs/Image or, with `compressed`, of CompressedImage (whose `format` is the
/// encoding, and which has no size and step of its own); views into the message.
struct ImageView {
  std::uint32_t width = 0, height = 0;
  std::string_view encoding;
  bool is_bigendian = false;
  std::uint32_t step = 0;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
  bool compressed = false;
};

/// 16UC1 and mono16 (millimetres) as CV_16UC1, 32FC1 (metres) as CV_32FC1; a copy. Compressed:
/// compressedDepth (PNG or RVL), or a PNG of 16 bits.
Checked<cv::Mat> depth_image(const ImageView& image);
/// rgb8, bgr8, rgba8, bgra8, PNG and JPEG as CV_8UC3 BGR; a copy.
Checked<cv::Mat> color_image(const ImageView& image);

/// What the pixel values and colours of masks mean.
class LabelTable {
 public:
  /// Throws InputError naming the class whose rgb is not "r,g,b" with values in 0 to 255, or is
  /// taken.
  explicit LabelTable(const ClassMap& classes);
  /// Pixel value of the label image; -1 for a colour of no class. `tolerance` is how far each
  /// channel may be off (the nearest class is taken).
  int value(std::uint8_t r, std::uint8_t g, std::uint8_t b, int tolerance = 0) const;
  /// Whether the value of a pixel belongs to a class that is listed. 0 and the default class need
  /// not be listed; with an empty list, every class is known.
  bool known(std::uint16_t pixel) const { return known_.empty() || known_[pixel]; }
  int class_of(std::uint16_t pixel) const { return pixel / divisor_; }
  bool has_colours() const { return !values_.empty(); }

 private:
  std::map<std::uint32_t, int> values_;
  std::vector<bool> known_;  // by pixel value
  int divisor_;
};

struct LabelImage {
  cv::Mat labels;  ///< CV_16UC1
  /// Colours of no class: they became class 0. Pixels, and up to 5 of the colours ("r,g,b").
  std::uint64_t unknown_pixels = 0;
  std::vector<std::string> unknown;
  /// Values of no listed class (they are kept): pixels, and up to 5 of the classes.
  std::uint64_t unlisted_pixels = 0;
  std::vector<std::int64_t> unlisted;
};
/// mono8, 8UC1, mono16, 16UC1, 32SC1, PNG: class indices. rgb8, bgr8, rgba8, bgra8, PNG, JPEG: by
/// colour (of a JPEG the nearest one; a grey JPEG is refused: its values are no ids any more). A
/// copy.
Checked<LabelImage> label_image(const ImageView& image, const LabelTable& labels);

/// An image in another size, nearest pixels; nothing when the sides' ratio differs by more than
/// 1 %.
std::optional<cv::Mat> resized_to(const cv::Mat& image, int width, int height);

/// Fields of sensor_msgs/CameraInfo, of the full image, row-major: `k` as the lens makes it, `p` of
/// the rectified image (all 0: not given); `distorted`: `d` has a coefficient that is not 0.
struct CameraInfoFields {
  std::uint32_t width = 0, height = 0;
  std::array<double, 9> k{};
  std::array<double, 12> p{};
  bool distorted = false;
  std::uint32_t binning_x = 0, binning_y = 0;  ///< 0 is 1
  std::uint32_t roi_x = 0, roi_y = 0;
  std::uint32_t roi_width = 0, roi_height = 0;  ///< 0: all
};
/// The camera of the image that is sent: the region of interest, binned (as image_geometry does).
/// Depth images are rectified: of a lens that distorts, `p` says what they are projected by, where
/// it is given; without distortion `k` says the same, and counts.
Checked<CameraModel> camera_model(const CameraInfoFields& info);

/// Names are there (a leading slash is left out, as tf2 does), values finite, the quaternion a unit
/// one; one that is off as little as tf2 takes (its square by 0.01) is corrected.
Checked<StampedTransform> checked_transform(StampedTransform transform);
/// The name of a frame without leading slash.
std::string frame_name(std::string name);

}  // namespace pocd

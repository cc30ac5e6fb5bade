#include "pocd/input/message_checks.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// Quaternions are sent as doubles, sometimes computed as floats; more than this is no rounding.
constexpr double kUnitTolerance = 1e-3;
// Of a field that is text from the bus, in a message about it.
constexpr std::size_t kLongestQuote = 64;

std::string text(double value) { return std::to_string(value); }
std::string text(const ImageView& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}
std::string quoted(std::string_view value) {
  return "\"" + std::string(value.substr(0, kLongestQuote)) + "\"";
}

/// What is wrong with the layout of an image of this OpenCV type, if anything.
std::optional<InputProblem> layout_problem(const ImageView& image, int type) {
  if (image.width == 0 || image.height == 0) {
    return InputProblem{InputReason::kEmptyImage, "image is " + text(image)};
  }
  if (image.width > kLargestSide_px || image.height > kLargestSide_px) {
    return InputProblem{InputReason::kTooLarge, "image is " + text(image)};
  }
  if (image.is_bigendian && CV_ELEM_SIZE1(type) != 1) {
    return InputProblem{InputReason::kBigEndian, "is_bigendian = 1"};
  }
  if (image.step < image.width * static_cast<std::uint32_t>(CV_ELEM_SIZE(type))) {
    return InputProblem{InputReason::kStepTooSmall, "step = " + std::to_string(image.step) +
                                                        " for " + text(image) + " " +
                                                        std::string(image.encoding)};
  }
  const std::size_t bytes = std::size_t{image.step} * image.height;
  if (image.size != bytes) {
    return InputProblem{InputReason::kDataSize, "data has " + std::to_string(image.size) +
                                                    " bytes, step * height is " +
                                                    std::to_string(bytes)};
  }
  return std::nullopt;
}

Checked<cv::Mat> copy_of(const ImageView& image, int type) {
  if (auto problem = layout_problem(image, type)) return std::move(*problem);
  cv::Mat copy(static_cast<int>(image.height), static_cast<int>(image.width), type);
  // Row by row: a step need not be a multiple of a pixel's size, which OpenCV's views insist on.
  const std::size_t row_bytes = image.width * copy.elemSize();
  for (int row = 0; row < copy.rows; ++row) {
    std::copy_n(image.data + std::size_t{image.step} * static_cast<std::size_t>(row), row_bytes,
                copy.ptr<std::uint8_t>(row));
  }
  return copy;
}

/// Samples of a byte each where they lie, not a copy: valid as long as the message.
cv::Mat bytes_of(const ImageView& image, int type) {
  return cv::Mat(static_cast<int>(image.height), static_cast<int>(image.width), type,
                 const_cast<std::uint8_t*>(image.data), image.step);
}

InputProblem unknown_encoding(const ImageView& image, const char* expected) {
  return {InputReason::kUnknownEncoding,
          "encoding " + quoted(image.encoding) + ", expected " + expected};
}

}  // namespace

Checked<cv::Mat> depth_image(const ImageView& image) {
  if (image.encoding == "16UC1" || image.encoding == "mono16") return copy_of(image, CV_16UC1);
  if (image.encoding == "32FC1") return copy_of(image, CV_32FC1);
  return unknown_encoding(image, "16UC1, mono16 (mm) or 32FC1 (m)");
}

Checked<cv::Mat> color_image(const ImageView& image) {
  if (image.encoding != "rgb8" && image.encoding != "bgr8") {
    return unknown_encoding(image, "rgb8 or bgr8");
  }
  if (image.encoding == "bgr8") return copy_of(image, CV_8UC3);
  if (auto problem = layout_problem(image, CV_8UC3)) return std::move(*problem);
  cv::Mat color;
  cv::cvtColor(bytes_of(image, CV_8UC3), color, cv::COLOR_RGB2BGR);
  return color;
}

ColourTable::ColourTable(const ClassMap& classes) {
  for (const ClassInfo& info : classes.list) {
    if (info.rgb.empty()) continue;
    const auto rgb = parse_rgb(info.rgb);
    if (!rgb) {
      throw InputError("classes.list: class " + std::to_string(info.id) + ": rgb \"" + info.rgb +
                       "\" is not \"r,g,b\" with values from 0 to 255");
    }
    const std::uint32_t key =
        std::uint32_t{(*rgb)[0]} << 16 | std::uint32_t{(*rgb)[1]} << 8 | std::uint32_t{(*rgb)[2]};
    if (!classes.fits_a_pixel(info.id)) {
      throw InputError("classes.list: class " + std::to_string(info.id) + " with label_divisor " +
                       std::to_string(classes.label_divisor) + " is beyond 16 bits");
    }
    if (!values_.emplace(key, info.id * classes.label_divisor).second) {
      throw InputError("classes.list: class " + std::to_string(info.id) + ": rgb \"" + info.rgb +
                       "\" is another class's colour already");
    }
  }
}

int ColourTable::value(std::uint8_t r, std::uint8_t g, std::uint8_t b) const {
  const auto found = values_.find(std::uint32_t{r} << 16 | std::uint32_t{g} << 8 | b);
  return found == values_.end() ? -1 : found->second;
}

Checked<LabelImage> label_image(const ImageView& image, const ColourTable& colours) {
  const std::string_view encoding = image.encoding;
  LabelImage result;
  if (encoding == "mono8" || encoding == "8UC1" || encoding == "mono16" || encoding == "16UC1") {
    const bool wide = encoding == "mono16" || encoding == "16UC1";
    if (auto problem = layout_problem(image, wide ? CV_16UC1 : CV_8UC1)) return std::move(*problem);
    if (wide) {
      result.labels = *copy_of(image, CV_16UC1).value;
    } else {
      bytes_of(image, CV_8UC1).convertTo(result.labels, CV_16U);
    }
    return result;
  }
  if (encoding != "rgb8" && encoding != "bgr8") {
    return unknown_encoding(image, "mono8, mono16, rgb8 or bgr8");
  }
  if (auto problem = layout_problem(image, CV_8UC3)) return std::move(*problem);
  const bool rgb = encoding == "rgb8";
  result.labels.create(static_cast<int>(image.height), static_cast<int>(image.width), CV_16UC1);
  // Masks are patches of one colour: the last lookup is nearly always the next one, too.
  std::uint32_t last_key = 0xFFFFFFFFu;
  int last_value = -1;
  for (int row = 0; row < result.labels.rows; ++row) {
    const std::uint8_t* in = image.data + std::size_t{image.step} * static_cast<std::size_t>(row);
    auto* out = result.labels.ptr<std::uint16_t>(row);
    for (int col = 0; col < result.labels.cols; ++col, in += 3) {
      const std::uint8_t r = rgb ? in[0] : in[2], g = in[1], b = rgb ? in[2] : in[0];
      const std::uint32_t key = std::uint32_t{r} << 16 | std::uint32_t{g} << 8 | b;
      if (key != last_key) {
        last_key = key;
        last_value = colours.value(r, g, b);
      }
      result.unknown_pixels += last_value < 0;
      out[col] = static_cast<std::uint16_t>(last_value < 0 ? 0 : last_value);
    }
  }
  return result;
}

Checked<CameraModel> camera_model(std::uint32_t width, std::uint32_t height,
                                  const std::array<double, 9>& k) {
  if (width == 0 || height == 0 || width > kLargestSide_px || height > kLargestSide_px) {
    return {InputReason::kBadImageSize,
            "camera info is for " + std::to_string(width) + "x" + std::to_string(height)};
  }
  for (const double value : k) {
    if (!std::isfinite(value)) return {InputReason::kNotFinite, "k has a value that is not finite"};
  }
  CameraModel camera;
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  camera.fx = k[0];
  camera.cx = k[2];
  camera.fy = k[4];
  camera.cy = k[5];
  if (camera.fx <= 0.0 || camera.fy <= 0.0) {
    return {InputReason::kZeroFocalLength, "fx = " + text(camera.fx) + ", fy = " + text(camera.fy)};
  }
  if (auto fault = camera_fault(camera); !fault.empty()) {
    return {InputReason::kBadIntrinsics, std::move(fault)};
  }
  return camera;
}

Checked<StampedTransform> checked_transform(StampedTransform transform) {
  if (transform.parent.empty() || transform.child.empty()) {
    return {InputReason::kEmptyFrameName,
            "frame_id " + quoted(transform.parent) + ", child_frame_id " + quoted(transform.child)};
  }
  if (transform.parent == transform.child) {
    return {InputReason::kTransformLoop,
            "frame_id and child_frame_id are both " + quoted(transform.child)};
  }
  const Eigen::Vector3d& position = transform.T.position;
  const Eigen::Vector4d xyzw = transform.T.rotation.coeffs();
  if (!position.allFinite() || !xyzw.allFinite()) {
    return {InputReason::kNotFinite, "position " + text(position.x()) + " " + text(position.y()) +
                                         " " + text(position.z()) + ", quaternion xyzw " +
                                         text(xyzw[0]) + " " + text(xyzw[1]) + " " + text(xyzw[2]) +
                                         " " + text(xyzw[3])};
  }
  const double norm = xyzw.norm();
  if (std::abs(norm - 1.0) > kUnitTolerance) {
    return {InputReason::kNonUnitQuaternion, "quaternion has length " + text(norm)};
  }
  // A unit quaternion keeps its bits; only one that is off is corrected.
  if (std::abs(norm - 1.0) > 1e-12) transform.T.rotation.normalize();
  return transform;
}

}  // namespace pocd

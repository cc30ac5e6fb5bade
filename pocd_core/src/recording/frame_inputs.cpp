#include "frame_inputs.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "pocd/common/check.hpp"

namespace pocd::recording {
namespace {

constexpr std::uint32_t kLargestSide = 16384;
// Quaternions are sent as doubles, sometimes computed as floats; more than this is no rounding.
constexpr double kUnitTolerance = 1e-3;

/// A view of the payload, after its sizes have been checked.
cv::Mat view_of(const RosImage& image, int type) {
  const std::size_t pixel_bytes = CV_ELEM_SIZE(type);
  const std::string size = std::to_string(image.width) + "x" + std::to_string(image.height);
  if (image.width == 0 || image.height == 0 || image.width > kLargestSide ||
      image.height > kLargestSide) {
    throw InputError("image is " + size);
  }
  if (image.is_bigendian != 0 && CV_ELEM_SIZE1(type) != 1) throw InputError("is_bigendian = 1");
  if (image.step < image.width * pixel_bytes) {
    throw InputError("step = " + std::to_string(image.step) + " for " + size + " " +
                     image.encoding);
  }
  const std::size_t bytes = std::size_t{image.step} * image.height;
  if (image.size != bytes) {
    throw InputError("data has " + std::to_string(image.size) + " bytes, step * height is " +
                     std::to_string(bytes));
  }
  // OpenCV has no view of constant data; nobody writes through this one.
  return cv::Mat(static_cast<int>(image.height), static_cast<int>(image.width), type,
                 const_cast<std::uint8_t*>(image.data), image.step);
}

[[noreturn]] void refuse_encoding(const RosImage& image, const char* expected) {
  throw InputError("encoding \"" + image.encoding.substr(0, 32) + "\", expected " + expected);
}

std::uint32_t colour_key(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
  return r << 16 | g << 8 | b;
}

}  // namespace

ColourValues colour_values(const ClassMap& classes) {
  ColourValues values;
  for (const ClassInfo& info : classes.list) {
    if (const auto rgb = parse_rgb(info.rgb)) {
      values[colour_key((*rgb)[0], (*rgb)[1], (*rgb)[2])] =
          static_cast<std::uint16_t>(info.id * classes.label_divisor);
    }
  }
  return values;
}

cv::Mat depth_image(const RosImage& image) {
  if (image.encoding == "16UC1" || image.encoding == "mono16") {
    return view_of(image, CV_16UC1).clone();
  }
  if (image.encoding == "32FC1") return view_of(image, CV_32FC1).clone();
  refuse_encoding(image, "16UC1, mono16 (mm) or 32FC1 (m)");
}

cv::Mat label_image(const RosImage& image, const ColourValues& colours) {
  cv::Mat labels;
  if (image.encoding == "mono8" || image.encoding == "8UC1") {
    view_of(image, CV_8UC1).convertTo(labels, CV_16U);
    return labels;
  }
  if (image.encoding == "mono16" || image.encoding == "16UC1") {
    return view_of(image, CV_16UC1).clone();
  }
  if (image.encoding != "rgb8" && image.encoding != "bgr8") {
    refuse_encoding(image, "mono8, mono16, rgb8 or bgr8");
  }
  const cv::Mat in = view_of(image, CV_8UC3);
  const int red = image.encoding == "rgb8" ? 0 : 2;
  labels.create(in.rows, in.cols, CV_16UC1);
  for (int row = 0; row < in.rows; ++row) {
    const std::uint8_t* pixel = in.ptr<std::uint8_t>(row);
    auto* out = labels.ptr<std::uint16_t>(row);
    for (int col = 0; col < in.cols; ++col, pixel += 3) {
      const auto found = colours.find(colour_key(pixel[red], pixel[1], pixel[2 - red]));
      out[col] = found == colours.end() ? std::uint16_t{0} : found->second;
    }
  }
  return labels;
}

cv::Mat color_image(const RosImage& image) {
  if (image.encoding == "bgr8") return view_of(image, CV_8UC3).clone();
  if (image.encoding != "rgb8") refuse_encoding(image, "rgb8 or bgr8");
  cv::Mat color;
  cv::cvtColor(view_of(image, CV_8UC3), color, cv::COLOR_RGB2BGR);
  return color;
}

CameraModel camera_model(const RosCameraInfo& info) {
  if (info.width > kLargestSide || info.height > kLargestSide) {
    throw InputError("camera info is for " + std::to_string(info.width) + "x" +
                     std::to_string(info.height));
  }
  CameraModel camera;
  camera.width = static_cast<int>(info.width);
  camera.height = static_cast<int>(info.height);
  camera.fx = info.k[0];
  camera.cx = info.k[2];
  camera.fy = info.k[4];
  camera.cy = info.k[5];
  validate(camera, "camera info");
  return camera;
}

RosTransform checked_transform(RosTransform transform) {
  if (transform.header.frame_id.empty() || transform.child_frame_id.empty()) {
    throw InputError("frame_id \"" + transform.header.frame_id + "\", child_frame_id \"" +
                     transform.child_frame_id + "\"");
  }
  if (!transform.T.position.allFinite() || !transform.T.rotation.coeffs().allFinite()) {
    throw InputError("pose has a value that is not finite");
  }
  const double norm = transform.T.rotation.coeffs().norm();
  if (std::abs(norm - 1.0) > kUnitTolerance) {
    throw InputError("quaternion has length " + std::to_string(norm));
  }
  // A unit quaternion keeps its bits; only one that is off is corrected.
  if (std::abs(norm - 1.0) > 1e-12) transform.T.rotation.normalize();
  return transform;
}

}  // namespace pocd::recording

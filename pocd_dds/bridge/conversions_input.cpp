#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "pocd/common/check.hpp"
#include "pocd_dds/bridge/conversions.hpp"

namespace pocd::dds {
namespace {

constexpr std::uint32_t kLargestSide = 16384;
// Quaternions are sent as doubles, sometimes computed as floats; more than this is no rounding.
constexpr double kUnitTolerance = 1e-3;

std::string text(double value) { return std::to_string(value); }

/// What is wrong with an image of `pixel_bytes` per pixel, if anything.
std::optional<InputProblem> layout_problem(const sensor_msgs::msg::Image& image,
                                           std::size_t pixel_bytes) {
  const std::string size = std::to_string(image.width()) + "x" + std::to_string(image.height());
  if (image.width() == 0 || image.height() == 0) {
    return InputProblem{InputReason::kEmptyImage, "image is " + size};
  }
  if (image.width() > kLargestSide || image.height() > kLargestSide) {
    return InputProblem{InputReason::kTooLarge, "image is " + size};
  }
  if (image.is_bigendian() != 0 && pixel_bytes != 1 && pixel_bytes != 3) {
    return InputProblem{InputReason::kBigEndian, "is_bigendian = 1"};
  }
  if (image.step() < image.width() * pixel_bytes) {
    return InputProblem{InputReason::kStepTooSmall, "step = " + std::to_string(image.step()) +
                                                        " for " + size + " " + image.encoding()};
  }
  const std::size_t bytes = std::size_t{image.step()} * image.height();
  if (image.data().size() != bytes) {
    return InputProblem{InputReason::kDataSize, "data has " + std::to_string(image.data().size()) +
                                                    " bytes, step * height is " +
                                                    std::to_string(bytes)};
  }
  return std::nullopt;
}

cv::Mat copy_of(const sensor_msgs::msg::Image& image, int type) {
  cv::Mat copy(static_cast<int>(image.height()), static_cast<int>(image.width()), type);
  // Row by row: a step need not be a multiple of a pixel's size, which OpenCV's views insist on.
  const std::size_t row_bytes = image.width() * copy.elemSize();
  for (int row = 0; row < copy.rows; ++row) {
    std::copy_n(image.data().data() + std::size_t{image.step()} * row, row_bytes,
                copy.ptr<std::uint8_t>(row));
  }
  return copy;
}

Checked<cv::Mat> image_from(const sensor_msgs::msg::Image& image, int type) {
  const std::size_t pixel_bytes = CV_ELEM_SIZE(type);
  if (auto problem = layout_problem(image, pixel_bytes)) return {problem->reason, problem->detail};
  return copy_of(image, type);
}

std::string unknown(const sensor_msgs::msg::Image& image, const char* expected) {
  return "encoding \"" + image.encoding() + "\", expected " + expected;
}

Checked<StampedTransform> transform_from_parts(const std_msgs::msg::Header& header,
                                               const std::string& child,
                                               const Eigen::Vector3d& position,
                                               const Eigen::Vector4d& xyzw) {
  if (header.frame_id().empty() || child.empty()) {
    return {InputReason::kEmptyFrameName,
            "frame_id \"" + header.frame_id() + "\", child_frame_id \"" + child + "\""};
  }
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
  StampedTransform transform;
  transform.parent = header.frame_id();
  transform.child = child;
  transform.stamp_ns = to_stamp(header.stamp());
  transform.T.position = position;
  transform.T.rotation = Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  // A unit quaternion keeps its bits; only one that is off is corrected.
  if (std::abs(norm - 1.0) > 1e-12) transform.T.rotation.normalize();
  return transform;
}

}  // namespace

StampNs to_stamp(const builtin_interfaces::msg::Time& time) {
  return StampNs{time.sec()} * 1'000'000'000 + time.nanosec();
}

builtin_interfaces::msg::Time to_time(StampNs stamp_ns) {
  constexpr StampNs kSecond = 1'000'000'000;
  StampNs seconds = stamp_ns / kSecond, rest = stamp_ns % kSecond;
  if (rest < 0) {
    --seconds;
    rest += kSecond;
  }
  builtin_interfaces::msg::Time time;
  time.sec(static_cast<std::int32_t>(seconds));
  time.nanosec(static_cast<std::uint32_t>(rest));
  return time;
}

Checked<cv::Mat> depth_from(const sensor_msgs::msg::Image& image) {
  if (image.encoding() == "16UC1" || image.encoding() == "mono16") {
    return image_from(image, CV_16UC1);
  }
  if (image.encoding() == "32FC1") return image_from(image, CV_32FC1);
  return {InputReason::kUnknownEncoding, unknown(image, "16UC1, mono16 (mm) or 32FC1 (m)")};
}

Checked<cv::Mat> color_from(const sensor_msgs::msg::Image& image) {
  if (image.encoding() != "rgb8" && image.encoding() != "bgr8") {
    return {InputReason::kUnknownEncoding, unknown(image, "rgb8 or bgr8")};
  }
  Checked<cv::Mat> color = image_from(image, CV_8UC3);
  if (color.value && image.encoding() == "rgb8") {
    cv::cvtColor(*color.value, *color.value, cv::COLOR_RGB2BGR);
  }
  return color;
}

ColourTable::ColourTable(const ClassMap& classes) {
  for (const ClassInfo& info : classes.list) {
    if (info.rgb.empty()) continue;
    int r = -1, g = -1, b = -1, end = 0;
    const int read = std::sscanf(info.rgb.c_str(), "%d ,%d ,%d %n", &r, &g, &b, &end);
    const auto byte = [](int value) { return value >= 0 && value <= 255; };
    if (read != 3 || static_cast<std::size_t>(end) != info.rgb.size() || !byte(r) || !byte(g) ||
        !byte(b)) {
      throw InputError("classes.list: class " + std::to_string(info.id) + ": rgb \"" + info.rgb +
                       "\" is not \"r,g,b\" with values from 0 to 255");
    }
    const auto key = static_cast<std::uint32_t>(r << 16 | g << 8 | b);
    if (!values_.emplace(key, info.id * classes.label_divisor).second) {
      throw InputError("classes.list: class " + std::to_string(info.id) + ": rgb \"" + info.rgb +
                       "\" is another class's colour already");
    }
  }
}

int ColourTable::value(std::uint8_t r, std::uint8_t g, std::uint8_t b) const {
  const auto found = values_.find(static_cast<std::uint32_t>(r << 16 | g << 8 | b));
  return found == values_.end() ? -1 : found->second;
}

Checked<LabelImage> labels_from(const sensor_msgs::msg::Image& image, const ColourTable& colours) {
  const std::string& encoding = image.encoding();
  LabelImage result;
  if (encoding == "mono8" || encoding == "8UC1" || encoding == "mono16" || encoding == "16UC1") {
    const bool wide = encoding == "mono16" || encoding == "16UC1";
    Checked<cv::Mat> labels = image_from(image, wide ? CV_16UC1 : CV_8UC1);
    if (!labels.value) return {labels.problem->reason, labels.problem->detail};
    labels.value->convertTo(result.labels, CV_16U);
    return result;
  }
  if (encoding != "rgb8" && encoding != "bgr8") {
    return {InputReason::kUnknownEncoding, unknown(image, "mono8, mono16, rgb8 or bgr8")};
  }
  if (auto problem = layout_problem(image, 3)) return {problem->reason, problem->detail};
  const bool rgb = encoding == "rgb8";
  result.labels.create(static_cast<int>(image.height()), static_cast<int>(image.width()), CV_16UC1);
  // Masks are patches of one colour: the last lookup is nearly always the next one, too.
  std::uint32_t last_key = 0xFFFFFFFFu;
  int last_value = -1;
  for (int row = 0; row < result.labels.rows; ++row) {
    const std::uint8_t* in = image.data().data() + std::size_t{image.step()} * row;
    auto* out = result.labels.ptr<std::uint16_t>(row);
    for (int col = 0; col < result.labels.cols; ++col, in += 3) {
      const std::uint8_t r = rgb ? in[0] : in[2], g = in[1], b = rgb ? in[2] : in[0];
      const auto key = static_cast<std::uint32_t>(r << 16 | g << 8 | b);
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

Checked<CameraModel> camera_from(const sensor_msgs::msg::CameraInfo& info) {
  if (info.width() == 0 || info.height() == 0 || info.width() > kLargestSide ||
      info.height() > kLargestSide) {
    return {InputReason::kBadImageSize, "camera info is for " + std::to_string(info.width()) + "x" +
                                            std::to_string(info.height())};
  }
  for (double value : info.k()) {
    if (!std::isfinite(value)) return {InputReason::kNotFinite, "k has a value that is not finite"};
  }
  CameraModel camera;
  camera.width = static_cast<int>(info.width());
  camera.height = static_cast<int>(info.height());
  camera.fx = info.k()[0];
  camera.cx = info.k()[2];
  camera.fy = info.k()[4];
  camera.cy = info.k()[5];
  if (camera.fx <= 0.0 || camera.fy <= 0.0) {
    return {InputReason::kZeroFocalLength, "fx = " + text(camera.fx) + ", fy = " + text(camera.fy)};
  }
  return camera;
}

Checked<StampedTransform> transform_from(const nav_msgs::msg::Odometry& odometry) {
  const auto& pose = odometry.pose().pose();
  return transform_from_parts(odometry.header(), odometry.child_frame_id(),
                              {pose.position().x(), pose.position().y(), pose.position().z()},
                              {pose.orientation().x(), pose.orientation().y(),
                               pose.orientation().z(), pose.orientation().w()});
}

Checked<StampedTransform> transform_from(const geometry_msgs::msg::TransformStamped& transform) {
  const auto& T = transform.transform();
  return transform_from_parts(
      transform.header(), transform.child_frame_id(),
      {T.translation().x(), T.translation().y(), T.translation().z()},
      {T.rotation().x(), T.rotation().y(), T.rotation().z(), T.rotation().w()});
}

}  // namespace pocd::dds

#include "pocd/input/frame.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

constexpr double kFarthest_m = 5e4;

std::string size_text(const cv::Mat& image) {
  return std::to_string(image.cols) + "x" + std::to_string(image.rows);
}

void check_size(const cv::Mat& image, const char* name, const CameraModel& camera,
                const std::string& source) {
  if (image.cols == camera.width && image.rows == camera.height) return;
  throw InputError(source + ": " + name + " image is " + size_text(image) + ", camera is " +
                   std::to_string(camera.width) + "x" + std::to_string(camera.height));
}

void check_type(const cv::Mat& image, const char* name, int type, const char* expected,
                const std::string& source) {
  if (image.type() == type) return;
  throw InputError(source + ": " + name + " image has OpenCV type " + std::to_string(image.type()) +
                   ", expected " + expected);
}

cv::Mat depth_in_metres(const cv::Mat& depth, const std::string& source) {
  cv::Mat metres(depth.rows, depth.cols, CV_32FC1);
  for (int row = 0; row < depth.rows; ++row) {
    float* out = metres.ptr<float>(row);
    if (depth.type() == CV_16UC1) {
      const std::uint16_t* in = depth.ptr<std::uint16_t>(row);
      for (int col = 0; col < depth.cols; ++col) {
        out[col] = in[col] == 65535 ? 0.0f : static_cast<float>(in[col]) * 0.001f;
      }
    } else if (depth.type() == CV_32FC1) {
      const float* in = depth.ptr<float>(row);
      for (int col = 0; col < depth.cols; ++col) {
        const bool good = in[col] > 0.0f && in[col] < std::numeric_limits<float>::infinity();
        out[col] = good ? in[col] : 0.0f;
      }
    } else {
      throw InputError(source + ": depth image has OpenCV type " + std::to_string(depth.type()) +
                       ", expected 16-bit millimetres (16UC1) or 32-bit metres (32FC1)");
    }
  }
  return metres;
}

}  // namespace

void validate_pose(const Pose& T, const std::string& source) {
  if (!T.matrix().allFinite()) throw InputError(source + ": pose has a value that is not finite");
  const double farthest_m = T.translation().cwiseAbs().maxCoeff();
  if (farthest_m > kFarthest_m) {
    throw InputError(source + ": pose is " + std::to_string(farthest_m) + " m away, farther than " +
                     std::to_string(kFarthest_m) + " m");
  }
  const Eigen::Matrix3d R = T.linear();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > 1e-3 || R.determinant() < 0.0) {
    throw InputError(source + ": pose rotation is not orthonormal (off by " +
                     std::to_string(error) + ")");
  }
}

Frame make_frame(StampNs stamp_ns, const CameraModel& camera, const Pose& T_W_C,
                 const cv::Mat& depth, const cv::Mat& labels, const cv::Mat& color,
                 const std::string& source) {
  validate(camera, source);
  validate_pose(T_W_C, source);
  check_size(depth, "depth", camera, source);
  Frame frame;
  frame.stamp_ns = stamp_ns;
  frame.camera = camera;
  frame.T_W_C = T_W_C;
  frame.depth_m = depth_in_metres(depth, source);
  if (!labels.empty()) {
    check_size(labels, "segmentation", camera, source);
    if (labels.type() == CV_8UC1) {
      labels.convertTo(frame.labels, CV_16U);
    } else {
      check_type(labels, "segmentation", CV_16UC1, "8- or 16-bit class indices", source);
      frame.labels = labels;
    }
  }
  if (!color.empty()) {
    check_size(color, "color", camera, source);
    check_type(color, "color", CV_8UC3, "8-bit BGR", source);
    frame.color = color;
  }
  return frame;
}

void validate_frame(const Frame& frame, const std::string& source) {
  validate(frame.camera, source);
  validate_pose(frame.T_W_C, source);
  check_size(frame.depth_m, "depth", frame.camera, source);
  check_type(frame.depth_m, "depth", CV_32FC1, "32-bit metres", source);
  if (!frame.labels.empty()) {
    check_size(frame.labels, "segmentation", frame.camera, source);
    check_type(frame.labels, "segmentation", CV_16UC1, "16-bit class indices", source);
  }
  if (!frame.color.empty()) {
    check_size(frame.color, "color", frame.camera, source);
    check_type(frame.color, "color", CV_8UC3, "8-bit BGR", source);
  }
}

}  // namespace pocd

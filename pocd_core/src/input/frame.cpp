#include "pocd/input/frame.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

std::string size_text(const cv::Mat& image) {
  return std::to_string(image.cols) + "x" + std::to_string(image.rows);
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
  const auto check_size = [&](const cv::Mat& image, const char* name) {
    if (image.cols != camera.width || image.rows != camera.height) {
      throw InputError(source + ": " + name + " image is " + size_text(image) + ", camera is " +
                       std::to_string(camera.width) + "x" + std::to_string(camera.height));
    }
  };
  check_size(depth, "depth");
  Frame frame;
  frame.stamp_ns = stamp_ns;
  frame.camera = camera;
  frame.T_W_C = T_W_C;
  frame.depth_m = depth_in_metres(depth, source);
  if (!labels.empty()) {
    check_size(labels, "segmentation");
    if (labels.type() == CV_8UC1) {
      labels.convertTo(frame.labels, CV_16U);
    } else if (labels.type() == CV_16UC1) {
      frame.labels = labels;
    } else {
      throw InputError(source + ": segmentation image has OpenCV type " +
                       std::to_string(labels.type()) + ", expected 8- or 16-bit class indices");
    }
  }
  if (!color.empty()) {
    check_size(color, "color");
    if (color.type() != CV_8UC3) {
      throw InputError(source + ": color image has OpenCV type " + std::to_string(color.type()) +
                       ", expected 8-bit BGR");
    }
    frame.color = color;
  }
  return frame;
}

}  // namespace pocd

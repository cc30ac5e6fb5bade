#include <algorithm>
#include <cmath>

#include "image_file.hpp"
#include "pcd_file.hpp"
#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

constexpr int kTableClass = 1, kObjectClass = 2;

/// Labels as the pipeline knows them (see open_pcd).
cv::Mat class_labels(const cv::Mat& raw, int divisor, const std::string& source) {
  cv::Mat out(raw.rows, raw.cols, CV_16UC1);
  for (int v = 0; v < raw.rows; ++v) {
    const std::int32_t* in = raw.ptr<std::int32_t>(v);
    std::uint16_t* label = out.ptr<std::uint16_t>(v);
    for (int u = 0; u < raw.cols; ++u) {
      const int class_id = in[u] == 0 ? 0 : in[u] < 10 ? kTableClass : kObjectClass;
      const int instance = divisor > 1 && class_id == kObjectClass ? in[u] / 10 : 0;
      if (in[u] < 0 || (divisor > 1 && instance >= divisor)) {
        throw InputError(source + ": label " + std::to_string(in[u]) +
                         " does not fit label_divisor " + std::to_string(divisor));
      }
      label[u] = static_cast<std::uint16_t>(class_id * divisor + instance);
    }
  }
  return out;
}

class PcdReader : public DatasetReader {
 public:
  explicit PcdReader(const DatasetOptions& options)
      : repeat_(options.repeat),
        label_divisor_(options.label_divisor),
        period_ns_(std::llround(1e9 / options.frame_rate_hz)) {
    if (repeat_ < 1) throw InputError("pcd: repeat must be >= 1, is " + std::to_string(repeat_));
    if (label_divisor_ < 1 || label_divisor_ > 10000) {
      throw InputError("pcd: label_divisor must be in [1, 10000]");
    }
    if (!options.camera)
      throw InputError("pcd: no camera given, neither by camera.yaml nor by option");
    if (!options.T_W_C) {
      throw InputError("pcd: no camera pose given, neither by camera.yaml nor by option");
    }
    camera_ = *options.camera;
    T_W_C_ = *options.T_W_C;
    validate(camera_, "pcd camera");
    validate_pose(T_W_C_, "pcd camera pose");
    for (const fs::path& folder : options.inputs) list(folder);
  }

  std::size_t size() const override { return files_.size() * static_cast<std::size_t>(repeat_); }
  CameraExtrinsics extrinsics() const override { return {}; }

  std::optional<Frame> next() override {
    while (next_ < size()) {
      const std::size_t file = next_ / static_cast<std::size_t>(repeat_);
      if (next_ % static_cast<std::size_t>(repeat_) == 0) {
        try {
          state_ = read(files_[file]);
        } catch (const InputError& error) {
          skip(error.what());
          skipped_ += static_cast<std::size_t>(repeat_ - 1);
          next_ += static_cast<std::size_t>(repeat_);
          continue;
        }
      }
      Frame frame = state_;
      frame.sequence = next_;
      frame.stamp_ns = static_cast<StampNs>(next_) * period_ns_;
      ++next_;
      return frame;
    }
    return std::nullopt;
  }

 private:
  void list(const fs::path& folder) {
    require_folder(folder);
    const std::size_t before = files_.size();
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".pcd") files_.push_back(entry.path());
    }
    if (files_.size() == before) throw InputError(folder.string() + ": no .pcd files in it");
    std::sort(files_.begin() + static_cast<std::ptrdiff_t>(before), files_.end());
  }

  Frame read(const fs::path& file) {
    const PcdImages images = read_pcd(file);
    if (!images.unread_labels.empty() && !told_unread_) {
      told_unread_ = true;
      problems_.push_back(file.string() + ": has no field label; " + images.unread_labels +
                          " is not read: call it label");
    }
    const cv::Mat labels = images.raw_labels.empty()
                               ? cv::Mat()
                               : class_labels(images.raw_labels, label_divisor_, file.string());
    return make_frame(0, camera_, T_W_C_, images.depth_m, labels, images.color, file.string());
  }

  int repeat_, label_divisor_;
  StampNs period_ns_;
  CameraModel camera_;
  Pose T_W_C_;
  std::vector<fs::path> files_;
  std::size_t next_ = 0;
  bool told_unread_ = false;
  Frame state_;
};

}  // namespace

std::unique_ptr<DatasetReader> open_pcd(const DatasetOptions& options) {
  return std::make_unique<PcdReader>(options);
}

}  // namespace pocd

#include "pocd/network/segmentation_network.hpp"

#include <cmath>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>

#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/network/network_config.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

/// OpenCV's dnn module logs what it also throws.
class Quiet {
 public:
  Quiet() : before_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~Quiet() { cv::utils::logging::setLogLevel(before_); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  cv::utils::logging::LogLevel before_;
};

/// What OpenCV says is wrong, on one line and without the places in its source.
std::string reason(const cv::Exception& error) {
  std::string text, word;
  for (const char c : error.err + ' ') {
    if (c != ' ' && c != '\n') {
      word += c;
      continue;
    }
    const bool place = word.empty() || word == ">" || word.rfind("./modules/", 0) == 0 ||
                       word.rfind("OpenCV(", 0) == 0;
    if (!place) text += (text.empty() ? "" : " ") + word;
    word.clear();
  }
  return text;
}

std::string shape_text(const cv::Mat& array) {
  std::string text;
  for (int i = 0; i < array.dims; ++i) {
    text += (i > 0 ? "x" : "") + std::to_string(array.size[i]);
  }
  return text;
}

NetworkConfig read_config(const fs::path& file) {
  NetworkFile read;
  load_config(read, {file});
  return read.network;
}

/// The pixel values of the masks, by the network's number of the class.
std::vector<std::uint16_t> values_of(const NetworkConfig& config, const ClassMap& classes,
                                     const fs::path& file) {
  std::vector<std::uint16_t> values;
  for (std::size_t i = 0; i < config.classes.size(); ++i) {
    const ClassInfo* found = nullptr;
    for (const ClassInfo& info : classes.list) {
      if (found == nullptr && info.name == config.classes[i]) found = &info;
    }
    if (found == nullptr) {
      throw InputError(file.string() + ": network.classes[" + std::to_string(i) + "]: \"" +
                       config.classes[i] + "\" is the name of no class in classes.list");
    }
    values.push_back(static_cast<std::uint16_t>(found->id * classes.label_divisor));
  }
  return values;
}

}  // namespace

struct SegmentationNetwork::Impl {
  Impl(fs::path model_file, const ClassMap& classes, int threads)
      : model(std::move(model_file)),
        file(fs::path(model).replace_extension(".yaml")),
        config(read_config(file)),
        values(values_of(config, classes, file)) {
    std::error_code error;
    if (!fs::is_regular_file(model, error)) throw InputError(model.string() + ": is no file");
    cv::setNumThreads(threads);
    const Quiet quiet;
    try {
      net = cv::dnn::readNetFromONNX(model.string());
    } catch (const cv::Exception& e) {
      throw InputError(model.string() + ": OpenCV cannot load the network: " + reason(e));
    }
    net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    labels(cv::Mat::zeros(config.input_height_px, config.input_width_px, CV_8UC3));
  }

  bool channels_last() const { return config.layout == TensorLayout::kNhwc; }

  /// CV_32F of the network's layout.
  cv::Mat input_of(const cv::Mat& color) const {
    cv::Mat image;
    cv::resize(color, image, {config.input_width_px, config.input_height_px}, 0, 0,
               cv::INTER_LINEAR);
    const bool rgb = config.channel_order == ChannelOrder::kRgb;
    const auto order = [&](const ColourValues& c) {
      return std::array<double, 3>{rgb ? c.red : c.blue, c.green, rgb ? c.blue : c.red};
    };
    const auto mean = order(config.mean), scale = order(config.scale);
    const int height = image.rows, width = image.cols;
    cv::Mat input(channels_last() ? std::vector<int>{1, height, width, 3}
                                  : std::vector<int>{1, 3, height, width},
                  CV_32F);
    auto* out = input.ptr<float>();
    const std::size_t plane = image.total();
    std::size_t pixel = 0;
    for (int row = 0; row < height; ++row) {
      const std::uint8_t* in = image.ptr(row);
      for (int col = 0; col < width; ++col, in += 3, ++pixel) {
        for (std::size_t c = 0; c < 3; ++c) {
          const double value = (in[rgb ? 2 - c : c] - mean[c]) * scale[c];
          out[channels_last() ? 3 * pixel + c : c * plane + pixel] = static_cast<float>(value);
        }
      }
    }
    return input;
  }

  [[noreturn]] void refuse(const cv::Mat& output, const std::string& expected) const {
    throw InputError(model.string() + ": the output is " + shape_text(output) + ", expected " +
                     expected + " as " + file.string() + " says");
  }

  /// One CV_32F plane for each class, 1xCxHxW or 1xHxWxC.
  std::vector<cv::Mat> planes_of(const cv::Mat& output) const {
    const int classes = static_cast<int>(values.size());
    const bool last = channels_last();
    if (output.dims != 4 || output.size[0] != 1 || output.size[last ? 3 : 1] != classes) {
      const std::string count = std::to_string(classes);
      refuse(output, last ? "1xHEIGHTxWIDTHx" + count : "1x" + count + "xHEIGHTxWIDTH");
    }
    const int height = output.size[last ? 1 : 2], width = output.size[last ? 2 : 3];
    const std::size_t size = static_cast<std::size_t>(height) * static_cast<std::size_t>(width);
    const auto* in = output.ptr<float>();
    std::vector<cv::Mat> planes;
    for (std::size_t c = 0; c < values.size(); ++c) {
      cv::Mat& plane = planes.emplace_back(height, width, CV_32F);
      auto* out = plane.ptr<float>();
      for (std::size_t i = 0; i < size; ++i)
        out[i] = in[last ? i * values.size() + c : c * size + i];
    }
    return planes;
  }

  cv::Mat from_logits(const cv::Mat& output, const cv::Size& size) const {
    cv::Mat best, labels(size, CV_16UC1, cv::Scalar(values.front())), plane;
    const std::vector<cv::Mat> planes = planes_of(output);
    for (std::size_t c = 0; c < planes.size(); ++c) {
      cv::resize(planes[c], plane, size, 0, 0, cv::INTER_LINEAR);
      if (c == 0) {
        best = plane.clone();
        continue;
      }
      for (int row = 0; row < size.height; ++row) {
        const auto* value = plane.ptr<float>(row);
        auto* top = best.ptr<float>(row);
        auto* label = labels.ptr<std::uint16_t>(row);
        for (int col = 0; col < size.width; ++col) {
          if (!(value[col] > top[col])) continue;
          top[col] = value[col];
          label[col] = values[c];
        }
      }
    }
    return labels;
  }

  cv::Mat from_class_ids(const cv::Mat& output, const cv::Size& size) const {
    std::vector<int> sides;
    for (int i = 0; i < output.dims; ++i) {
      // Batch and channel are sides of 1.
      if (output.size[i] != 1 || output.dims == 2) sides.push_back(output.size[i]);
    }
    if (sides.size() != 2) refuse(output, "one plane of class numbers");
    cv::Mat numbers;
    cv::Mat(sides[0], sides[1], output.type(), output.data).convertTo(numbers, CV_32F);
    cv::Mat small(sides[0], sides[1], CV_16UC1), labels;
    for (int row = 0; row < small.rows; ++row) {
      for (int col = 0; col < small.cols; ++col) {
        const float number = numbers.at<float>(row, col);
        if (!(number >= 0.0f && number < static_cast<float>(values.size()))) {
          throw InputError(model.string() + ": the output has class " + std::to_string(number) +
                           ", " + file.string() + " names " + std::to_string(values.size()));
        }
        small.at<std::uint16_t>(row, col) = values[static_cast<std::size_t>(number)];
      }
    }
    cv::resize(small, labels, size, 0, 0, cv::INTER_NEAREST);
    return labels;
  }

  cv::Mat labels(const cv::Mat& color) {
    POCD_CHECK(color.type() == CV_8UC3 && !color.empty());
    cv::Mat output;
    try {
      net.setInput(input_of(color));
      output = net.forward();
    } catch (const cv::Exception& e) {
      throw InputError(model.string() + ": OpenCV cannot run the network: " + reason(e));
    }
    const bool logits = config.output == NetworkOutput::kLogits;
    if (logits && output.type() != CV_32F) refuse(output, "real numbers");
    return logits ? from_logits(output, color.size()) : from_class_ids(output, color.size());
  }

  const fs::path model, file;
  const NetworkConfig config;
  const std::vector<std::uint16_t> values;
  cv::dnn::Net net;
};

SegmentationNetwork::SegmentationNetwork(const fs::path& model, const ClassMap& classes,
                                         int threads)
    : impl_(std::make_unique<Impl>(model, classes, threads)) {}

SegmentationNetwork::~SegmentationNetwork() = default;

cv::Mat SegmentationNetwork::labels(const cv::Mat& color) { return impl_->labels(color); }

}  // namespace pocd

// Images of messages to images of the core, with every check.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <string>

#include "compressed_image.hpp"
#include "pocd/common/check.hpp"
#include "pocd/input/message_checks.hpp"

namespace pocd {
namespace {

// Of a field that is text from the bus, in a message about it.
constexpr std::size_t kLongestQuote = 64;
constexpr std::size_t kMostNamed = 5;
// How far the colour of a flat patch is off after JPEG: roundings of two transforms of colour, and
// of the mean of a block.
constexpr int kJpegTolerance = 12;

std::string text(const ImageView& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

/// What is wrong with the layout of an image of this OpenCV type, if anything.
std::optional<InputProblem> layout_problem(const ImageView& image, int type) {
  if (image.width == 0 || image.height == 0) {
    return InputProblem{InputReason::kEmptyImage, "image is " + text(image)};
  }
  if (image.width > kLargestSide_px || image.height > kLargestSide_px) {
    return InputProblem{InputReason::kTooLarge, "image is " + text(image)};
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
  const std::size_t row_bytes = image.width * copy.elemSize(), sample = copy.elemSize1();
  for (int row = 0; row < copy.rows; ++row) {
    std::uint8_t* out = copy.ptr<std::uint8_t>(row);
    std::copy_n(image.data + std::size_t{image.step} * static_cast<std::size_t>(row), row_bytes,
                out);
    if (!image.is_bigendian || sample == 1) continue;
    for (std::size_t i = 0; i < row_bytes; i += sample) std::reverse(out + i, out + i + sample);
  }
  return copy;
}

InputProblem unknown_encoding(const ImageView& image, const std::string& expected) {
  return {InputReason::kUnknownEncoding, "encoding \"" +
                                             std::string(image.encoding.substr(0, kLongestQuote)) +
                                             "\", expected " + expected};
}

/// How a colour lies in a pixel; no channels: not a colour.
struct ColourLayout {
  int channels = 0;
  int red = 0, blue = 2;
};
ColourLayout colour_layout(std::string_view encoding) {
  if (encoding == "rgb8") return {3, 0, 2};
  if (encoding == "bgr8" || encoding == "8UC3") return {3, 2, 0};
  if (encoding == "rgba8") return {4, 0, 2};
  if (encoding == "bgra8" || encoding == "8UC4") return {4, 2, 0};
  return {};
}

/// A decoded picture, as a message of the same content.
ImageView view_of(const cv::Mat& picture) {
  ImageView view;
  view.width = static_cast<std::uint32_t>(picture.cols);
  view.height = static_cast<std::uint32_t>(picture.rows);
  view.encoding = picture.type() == CV_8UC1    ? "mono8"
                  : picture.type() == CV_16UC1 ? "mono16"
                  : picture.type() == CV_8UC3  ? "bgr8"
                                               : "bgra8";
  view.step = static_cast<std::uint32_t>(picture.step);
  view.data = picture.data;
  view.size = picture.step * static_cast<std::size_t>(picture.rows);
  return view;
}

template <class Value>
void name_once(const Value& value, std::vector<Value>& named) {
  if (named.size() >= kMostNamed) return;
  if (std::find(named.begin(), named.end(), value) == named.end()) named.push_back(value);
}

/// Masks are patches of one value: the last lookup is nearly always the next one, too.
void find_unlisted(const LabelTable& table, LabelImage& image) {
  int last = -1;
  bool listed = true;
  for (int row = 0; row < image.labels.rows; ++row) {
    const auto* in = image.labels.ptr<std::uint16_t>(row);
    for (int col = 0; col < image.labels.cols; ++col) {
      if (in[col] != last) {
        last = in[col];
        listed = table.known(in[col]);
        if (!listed) name_once<std::int64_t>(table.class_of(in[col]), image.unlisted);
      }
      image.unlisted_pixels += !listed;
    }
  }
}

Checked<LabelImage> coloured_labels(const ImageView& image, const LabelTable& table,
                                    const ColourLayout& layout, int tolerance) {
  if (auto problem = layout_problem(image, CV_8UC(layout.channels))) return std::move(*problem);
  LabelImage result;
  result.labels.create(static_cast<int>(image.height), static_cast<int>(image.width), CV_16UC1);
  std::uint32_t last_key = 0xFFFFFFFFu;
  int last_value = -1;
  for (int row = 0; row < result.labels.rows; ++row) {
    const std::uint8_t* in = image.data + std::size_t{image.step} * static_cast<std::size_t>(row);
    auto* out = result.labels.ptr<std::uint16_t>(row);
    for (int col = 0; col < result.labels.cols; ++col, in += layout.channels) {
      const std::uint8_t r = in[layout.red], g = in[1], b = in[layout.blue];
      const std::uint32_t key = std::uint32_t{r} << 16 | std::uint32_t{g} << 8 | b;
      if (key != last_key) {
        last_key = key;
        last_value = table.value(r, g, b, tolerance);
        if (last_value < 0) {
          name_once(std::to_string(r) + "," + std::to_string(g) + "," + std::to_string(b),
                    result.unknown);
        }
      }
      result.unknown_pixels += last_value < 0;
      out[col] = static_cast<std::uint16_t>(last_value < 0 ? 0 : last_value);
    }
  }
  return result;
}

/// Ids beyond 16 bits, and negative ones, become the largest one, which is hardly ever a class.
cv::Mat narrowed(const cv::Mat& wide) {
  cv::Mat labels(wide.rows, wide.cols, CV_16UC1);
  for (int row = 0; row < wide.rows; ++row) {
    const auto* in = wide.ptr<std::int32_t>(row);
    auto* out = labels.ptr<std::uint16_t>(row);
    for (int col = 0; col < wide.cols; ++col) {
      out[col] = in[col] < 0 || in[col] > 65535 ? 65535 : static_cast<std::uint16_t>(in[col]);
    }
  }
  return labels;
}

/// By the values that were sent, in place of the one that they became.
void name_unlisted_wide(const cv::Mat& wide, const LabelTable& table, LabelImage& image) {
  if (image.unlisted_pixels == 0 || table.known(65535)) return;
  std::vector<std::int64_t> ids;
  for (int row = 0; row < wide.rows; ++row) {
    const auto* in = wide.ptr<std::int32_t>(row);
    for (int col = 0; col < wide.cols; ++col) {
      if (in[col] < 0 || in[col] > 65535) name_once<std::int64_t>(in[col], ids);
    }
  }
  if (ids.empty()) return;
  const std::int64_t became = table.class_of(65535);
  for (const std::int64_t id : image.unlisted) {
    if (id != became) name_once(id, ids);
  }
  image.unlisted = std::move(ids);
}

Checked<LabelImage> raw_labels(const ImageView& image, const LabelTable& table, int tolerance) {
  const std::string_view encoding = image.encoding;
  if (const ColourLayout layout = colour_layout(encoding); layout.channels > 0) {
    return coloured_labels(image, table, layout, tolerance);
  }
  const bool bytes = encoding == "mono8" || encoding == "8UC1";
  const bool words = encoding == "mono16" || encoding == "16UC1";
  if (!bytes && !words && encoding != "32SC1") {
    return unknown_encoding(image, "mono8, mono16, 32SC1, rgb8, bgr8, rgba8 or bgra8");
  }
  Checked<cv::Mat> copy = copy_of(image, bytes ? CV_8UC1 : words ? CV_16UC1 : CV_32SC1);
  if (copy.problem) return std::move(*copy.problem);
  LabelImage result;
  if (words) {
    result.labels = std::move(*copy.value);
  } else if (bytes) {
    copy.value->convertTo(result.labels, CV_16U);
  } else {
    result.labels = narrowed(*copy.value);
  }
  find_unlisted(table, result);
  if (!bytes && !words) name_unlisted_wide(*copy.value, table, result);
  return result;
}

}  // namespace

Checked<cv::Mat> depth_image(const ImageView& image) {
  if (image.compressed) return decode_depth(image);
  if (image.encoding == "16UC1" || image.encoding == "mono16") return copy_of(image, CV_16UC1);
  if (image.encoding == "32FC1") return copy_of(image, CV_32FC1);
  return unknown_encoding(image, "16UC1, mono16 (mm) or 32FC1 (m)");
}

Checked<cv::Mat> color_image(const ImageView& image) {
  if (image.compressed) {
    Checked<Picture> picture = decode_picture(image);
    if (picture.problem) return std::move(*picture.problem);
    return color_image(view_of(picture.value->pixels));
  }
  if (image.encoding == "mono8") {
    Checked<cv::Mat> grey = copy_of(image, CV_8UC1);
    if (grey.value) cv::cvtColor(*grey.value, *grey.value, cv::COLOR_GRAY2BGR);
    return grey;
  }
  const ColourLayout layout = colour_layout(image.encoding);
  if (layout.channels == 0) {
    return unknown_encoding(image, "rgb8, bgr8, rgba8, bgra8 or mono8");
  }
  Checked<cv::Mat> color = copy_of(image, CV_8UC(layout.channels));
  if (color.problem) return color;
  const bool rgb = layout.red == 0;
  if (layout.channels == 4) {
    cv::cvtColor(*color.value, *color.value, rgb ? cv::COLOR_RGBA2BGR : cv::COLOR_BGRA2BGR);
  } else if (rgb) {
    cv::cvtColor(*color.value, *color.value, cv::COLOR_RGB2BGR);
  }
  return color;
}

Checked<LabelImage> label_image(const ImageView& image, const LabelTable& labels) {
  if (!image.compressed) return raw_labels(image, labels, 0);
  Checked<Picture> picture = decode_picture(image);
  if (picture.problem) return std::move(*picture.problem);
  const Picture& decoded = *picture.value;
  if (decoded.lossy && decoded.pixels.channels() == 1) {
    return InputProblem{InputReason::kBadCompression,
                        "format \"" + std::string(image.encoding.substr(0, kLongestQuote)) +
                            "\": a JPEG changes the ids of classes; send masks as PNG"};
  }
  return raw_labels(view_of(decoded.pixels), labels, decoded.lossy ? kJpegTolerance : 0);
}

std::optional<cv::Mat> resized_to(const cv::Mat& image, int width, int height) {
  if (image.cols == width && image.rows == height) return image;
  const double ratio = static_cast<double>(image.cols) * height;
  const double wanted = static_cast<double>(width) * image.rows;
  if (image.empty() || std::abs(ratio - wanted) > 0.01 * wanted) return std::nullopt;
  cv::Mat out(height, width, image.type());
  const std::size_t bytes = image.elemSize();
  for (int row = 0; row < height; ++row) {
    // The source pixel that has the centre of this one in it.
    const int from = static_cast<int>((std::int64_t{row} * 2 + 1) * image.rows / (2 * height));
    for (int col = 0; col < width; ++col) {
      const auto at = static_cast<std::size_t>((std::int64_t{col} * 2 + 1) * image.cols /
                                               (std::int64_t{2} * width));
      std::memcpy(out.ptr(row) + static_cast<std::size_t>(col) * bytes,
                  image.ptr(from) + at * bytes, bytes);
    }
  }
  return out;
}

LabelTable::LabelTable(const ClassMap& classes) : divisor_(classes.label_divisor) {
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
  if (classes.list.empty()) return;
  known_.assign(65536, false);
  const auto mark = [&](int id) {
    const std::size_t begin = static_cast<std::size_t>(id) * static_cast<std::size_t>(divisor_);
    const std::size_t end =
        std::min<std::size_t>(begin + static_cast<std::size_t>(divisor_), 65536);
    for (std::size_t pixel = begin; pixel < end; ++pixel) known_[pixel] = true;
  };
  mark(0);
  mark(classes.default_class);
  for (const ClassInfo& info : classes.list) mark(info.id);
}

int LabelTable::value(std::uint8_t r, std::uint8_t g, std::uint8_t b, int tolerance) const {
  const auto found = values_.find(std::uint32_t{r} << 16 | std::uint32_t{g} << 8 | b);
  if (found != values_.end()) return found->second;
  int nearest = -1, distance = tolerance + 1;
  for (const auto& [key, value] : values_) {
    if (tolerance == 0) break;
    const int off = std::max({std::abs(r - static_cast<int>(key >> 16)),
                              std::abs(g - static_cast<int>(key >> 8 & 0xFF)),
                              std::abs(b - static_cast<int>(key & 0xFF))});
    if (off >= distance) continue;
    distance = off;
    nearest = value;
  }
  return nearest;
}

}  // namespace pocd

#include "compressed_image.hpp"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "pocd/common/image_codec.hpp"

namespace pocd {
namespace {

constexpr std::size_t kDepthHeaderBytes = 12;
constexpr std::uint8_t kPng[] = {0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A};

struct Bytes {
  const std::uint8_t* data;
  std::size_t size;
};

InputProblem damaged(const ImageView& image, const std::string& what) {
  return {InputReason::kBadCompression,
          "format \"" + std::string(image.encoding.substr(0, 64)) + "\": " + what};
}

std::uint32_t big_endian(const std::uint8_t* at, int bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | at[i];
  return value;
}

bool is_png(const Bytes& bytes) {
  return bytes.size > 33 && std::equal(std::begin(kPng), std::end(kPng), bytes.data);
}
bool is_jpeg(const Bytes& bytes) {
  return bytes.size > 4 && bytes.data[0] == 0xFF && bytes.data[1] == 0xD8 && bytes.data[2] == 0xFF;
}

struct Size {
  std::uint32_t width = 0, height = 0;
};

Size png_size(const Bytes& bytes) {
  return {big_endian(bytes.data + 16, 4), big_endian(bytes.data + 20, 4)};
}

/// Whether all chunks are there and have their sums: libpng would say otherwise on stderr, for
/// every image.
bool png_is_whole(const Bytes& bytes) {
  for (std::size_t at = sizeof kPng; bytes.size - at >= 12;) {
    const std::uint8_t* chunk = bytes.data + at;
    const std::size_t length = big_endian(chunk, 4);
    if (length > bytes.size - at - 12) return false;
    const uLong sum = ::crc32(0, chunk + 4, static_cast<uInt>(length + 4));
    if (sum != big_endian(chunk + 8 + length, 4)) return false;
    if (std::memcmp(chunk + 4, "IEND", 4) == 0) return true;
    at += 12 + length;
  }
  return false;
}

/// Of the first frame header; 0 when there is none.
Size jpeg_size(const Bytes& bytes) {
  for (std::size_t at = 2; at + 9 < bytes.size && bytes.data[at] == 0xFF;) {
    const std::uint8_t marker = bytes.data[at + 1];
    const bool frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (frame) return {big_endian(bytes.data + at + 7, 2), big_endian(bytes.data + at + 5, 2)};
    at += 2 + big_endian(bytes.data + at + 2, 2);
  }
  return {};
}

/// The size is looked at first: a few bytes can announce an image that fills the memory.
Checked<Picture> decode(const ImageView& image, const Bytes& bytes) {
  const bool png = is_png(bytes);
  if (!png && !is_jpeg(bytes)) return damaged(image, "its data is neither PNG nor JPEG");
  const Size size = png ? png_size(bytes) : jpeg_size(bytes);
  if (size.width == 0 || size.height == 0) return damaged(image, "its size cannot be read");
  if (size.width > kLargestSide_px || size.height > kLargestSide_px) {
    return {InputReason::kTooLarge,
            "image is " + std::to_string(size.width) + "x" + std::to_string(size.height)};
  }
  if (png && !png_is_whole(bytes)) return damaged(image, "its PNG is cut off or damaged");
  Picture picture;
  picture.lossy = !png;
  picture.pixels = png ? decode_png(bytes.data, bytes.size, kLargestSide_px)
                       : decode_jpeg(bytes.data, bytes.size, kLargestSide_px);
  const int type = picture.pixels.type();
  if (picture.pixels.empty()) {
    return damaged(image, std::string("its ") + (png ? "PNG" : "JPEG") + " cannot be decoded");
  }
  if (type != CV_8UC1 && type != CV_16UC1 && type != CV_8UC3 && type != CV_8UC4) {
    return damaged(image, "its picture has OpenCV type " + std::to_string(type) +
                              ", expected 8 or 16 bits, or colours of 8 bits");
  }
  return picture;
}

/// Runs of zeros and of differences, in nibbles of which each has three bits and says whether
/// another one follows; eight to a word, little endian, first nibble highest.
class RvlReader {
 public:
  explicit RvlReader(const Bytes& bytes) : bytes_(bytes) {}

  /// False: the data ends, or is no number of 32 bits.
  bool number(std::uint32_t& value) {
    value = 0;
    for (int shift = 0; shift < 32; shift += 3) {
      if (nibbles_ == 0) {
        if (bytes_.size - at_ < 4) return false;
        word_ = 0;
        for (int i = 3; i >= 0; --i)
          word_ = word_ << 8 | bytes_.data[at_ + static_cast<std::size_t>(i)];
        at_ += 4;
        nibbles_ = 8;
      }
      const std::uint32_t nibble = word_ >> 28;
      word_ <<= 4;
      --nibbles_;
      value |= (nibble & 7u) << shift;
      if ((nibble & 8u) == 0) return true;
    }
    return false;
  }

 private:
  Bytes bytes_;
  std::size_t at_ = 0;
  std::uint32_t word_ = 0;
  int nibbles_ = 0;
};

Checked<cv::Mat> decode_rvl(const ImageView& image, const Bytes& bytes) {
  if (bytes.size < 8) return damaged(image, "its RVL data ends before the size");
  std::uint32_t cols = 0, rows = 0;
  std::memcpy(&cols, bytes.data, 4);
  std::memcpy(&rows, bytes.data + 4, 4);
  if (cols == 0 || rows == 0) return {InputReason::kEmptyImage, "image has no pixels"};
  if (cols > kLargestSide_px || rows > kLargestSide_px) {
    return {InputReason::kTooLarge,
            "image is " + std::to_string(cols) + "x" + std::to_string(rows)};
  }
  cv::Mat depth(static_cast<int>(rows), static_cast<int>(cols), CV_16UC1, cv::Scalar(0));
  auto* out = depth.ptr<std::uint16_t>();
  std::size_t left = std::size_t{cols} * rows;
  RvlReader in({bytes.data + 8, bytes.size - 8});
  std::int32_t value = 0;
  while (left > 0) {
    std::uint32_t zeros = 0, values = 0;
    if (!in.number(zeros) || zeros > left) return damaged(image, "its RVL data is damaged");
    out += zeros;
    left -= zeros;
    if (left == 0) break;
    if (!in.number(values) || values > left) return damaged(image, "its RVL data is damaged");
    if (zeros == 0 && values == 0) return damaged(image, "its RVL data is damaged");
    left -= values;
    for (; values > 0; --values) {
      std::uint32_t difference = 0;
      if (!in.number(difference)) return damaged(image, "its RVL data is damaged");
      value +=
          static_cast<std::int32_t>(difference >> 1) ^ -static_cast<std::int32_t>(difference & 1u);
      value &= 0xFFFF;
      *out++ = static_cast<std::uint16_t>(value);
    }
  }
  return depth;
}

cv::Mat metres_of(const cv::Mat& inverse, float a, float b) {
  cv::Mat depth(inverse.rows, inverse.cols, CV_32FC1);
  for (int row = 0; row < depth.rows; ++row) {
    const auto* in = inverse.ptr<std::uint16_t>(row);
    auto* out = depth.ptr<float>(row);
    for (int col = 0; col < depth.cols; ++col) {
      out[col] = in[col] == 0 ? 0.0f : a / (static_cast<float>(in[col]) - b);
    }
  }
  return depth;
}

/// As words of a format are found, whatever their case.
bool has(std::string_view text, std::string_view part) {
  const auto same = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) ==
           std::tolower(static_cast<unsigned char>(b));
  };
  return std::search(text.begin(), text.end(), part.begin(), part.end(), same) != text.end();
}

/// Some write the payload without header, others the header without saying so in the format.
bool has_header(std::string_view format, const Bytes& bytes) {
  if (is_png(bytes) || is_jpeg(bytes)) return false;
  if (has(format, "compressedDepth")) return true;
  return bytes.size > kDepthHeaderBytes &&
         is_png({bytes.data + kDepthHeaderBytes, bytes.size - kDepthHeaderBytes});
}

}  // namespace

Checked<Picture> decode_picture(const ImageView& image) {
  return decode(image, {image.data, image.size});
}

Checked<cv::Mat> decode_depth(const ImageView& image) {
  const std::string_view format = image.encoding;
  Bytes bytes{image.data, image.size};
  const bool with_header = has_header(format, bytes);
  float parameters[2] = {0.0f, 0.0f};
  if (with_header) {
    if (image.size <= kDepthHeaderBytes) return damaged(image, "its data ends in the header");
    std::memcpy(parameters, image.data + 4, sizeof parameters);
    bytes = {image.data + kDepthHeaderBytes, image.size - kDepthHeaderBytes};
  }
  cv::Mat values;
  if (with_header && has(format, "rvl")) {
    Checked<cv::Mat> rvl = decode_rvl(image, bytes);
    if (rvl.problem) return rvl;
    values = std::move(*rvl.value);
  } else {
    Checked<Picture> picture = decode(image, bytes);
    if (picture.problem) return std::move(*picture.problem);
    values = picture.value->pixels;
    if (picture.value->lossy || values.type() != CV_16UC1) {
      return damaged(image,
                     "depth in 8 bits or with losses is not used; expected a PNG of 16 bits");
    }
  }
  const bool inverse = format.substr(0, 5) == "32FC1";
  if (!inverse) return values;
  if (!with_header || !std::isfinite(parameters[0]) || !std::isfinite(parameters[1]) ||
      parameters[0] <= 0.0f) {
    return damaged(image, "its parameters of inverse depth are " + std::to_string(parameters[0]) +
                              ", " + std::to_string(parameters[1]));
  }
  return metres_of(values, parameters[0], parameters[1]);
}

}  // namespace pocd

#include "image_file.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

/// Image libraries fill what a cut file lacks with grey or zero and only warn, so the end marker of
/// the format is looked for first.
void require_whole(const std::vector<unsigned char>& bytes, const fs::path& file) {
  const auto ends_with = [&](std::initializer_list<unsigned char> tail) {
    return std::search(bytes.size() > 64 ? bytes.end() - 64 : bytes.begin(), bytes.end(),
                       tail.begin(), tail.end()) != bytes.end();
  };
  const bool png = bytes.size() > 8 && bytes[0] == 0x89 && bytes[1] == 'P';
  const bool jpeg = bytes.size() > 8 && bytes[0] == 0xFF && bytes[1] == 0xD8;
  if ((png && !ends_with({'I', 'E', 'N', 'D'})) || (jpeg && !ends_with({0xFF, 0xD9}))) {
    throw InputError(file.string() + ": image is truncated");
  }
}

std::vector<unsigned char> bytes_of(const fs::path& file) {
  std::error_code error;
  const bool regular = fs::is_regular_file(file, error);
  const std::uintmax_t size = regular ? fs::file_size(file, error) : 0;
  std::ifstream in(file, std::ios::binary);
  if (!regular || error || !in) throw InputError(file.string() + ": cannot be read");
  std::vector<unsigned char> bytes(size);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

using Bytes = std::vector<unsigned char>;

/// Reads a number of `count` bytes; -1 beyond the end.
long number_at(const Bytes& bytes, std::size_t at, int count, bool big_endian) {
  if (at + static_cast<std::size_t>(count) > bytes.size()) return -1;
  long value = 0;
  for (int i = 0; i < count; ++i) {
    value = value << 8 | bytes[at + static_cast<std::size_t>(big_endian ? i : count - 1 - i)];
  }
  return value;
}

/// Width and height as the header says them; neither is positive for an unknown format or a damaged
/// header. A few kilobytes can hold an image of gigabytes.
std::pair<long, long> announced_size(const Bytes& bytes) {
  const auto begins_with = [&](std::initializer_list<unsigned char> start) {
    return bytes.size() >= start.size() && std::equal(start.begin(), start.end(), bytes.begin());
  };
  if (begins_with({0x89, 'P', 'N', 'G'})) {
    return {number_at(bytes, 16, 4, true), number_at(bytes, 20, 4, true)};
  }
  if (begins_with({0x76, 0x2F, 0x31, 0x01})) {  // OpenEXR: box of whole numbers, ends included
    const std::string name("dataWindow\0box2i\0", 17);
    const auto found = std::search(bytes.begin(), bytes.end(), name.begin(), name.end());
    if (found == bytes.end()) return {0, 0};
    const auto at = static_cast<std::size_t>(found - bytes.begin()) + name.size() + 4;
    const auto corner = [&](std::size_t i) {
      return static_cast<long>(static_cast<std::int32_t>(number_at(bytes, at + 4 * i, 4, false)));
    };
    return {corner(2) - corner(0) + 1, corner(3) - corner(1) + 1};
  }
  if (!begins_with({0xFF, 0xD8})) return {0, 0};
  for (std::size_t at = 2; at + 4 <= bytes.size() && bytes[at] == 0xFF;) {  // JPEG: segments
    const int marker = bytes[at + 1];
    const bool frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (frame) return {number_at(bytes, at + 7, 2, true), number_at(bytes, at + 5, 2, true)};
    at += marker == 0xFF ? 1 : 2 + static_cast<std::size_t>(number_at(bytes, at + 2, 2, true));
  }
  return {0, 0};
}

void check_size(const Bytes& bytes, cv::Size expected, const fs::path& file) {
  const auto [width, height] = announced_size(bytes);
  const std::string text = std::to_string(width) + "x" + std::to_string(height);
  if (width < 1 || height < 1) {
    throw InputError(file.string() + ": is no PNG, JPEG or OpenEXR image that can be decoded");
  }
  if (width > kLargestSide_px || height > kLargestSide_px) {
    throw InputError(file.string() + ": image is " + text + ", more than " +
                     std::to_string(kLargestSide_px) + " a side");
  }
  if (expected.width > 0 && (width != expected.width || height != expected.height)) {
    throw InputError(file.string() + ": image is " + text + ", camera is " +
                     std::to_string(expected.width) + "x" + std::to_string(expected.height));
  }
}

cv::Mat read_image(const fs::path& file, cv::Size size, int flags) {
  const Bytes bytes = bytes_of(file);
  if (bytes.empty()) throw InputError(file.string() + ": file is empty");
  require_whole(bytes, file);
  check_size(bytes, size, file);
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, flags);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) throw InputError(file.string() + ": is no image that can be decoded");
  return image;
}

std::string kind_of(const cv::Mat& image) {
  return std::to_string(image.channels()) + " channel(s) of " +
         std::to_string(8 * image.elemSize1()) + " bits";
}

}  // namespace

cv::Mat read_depth_image(const fs::path& file, cv::Size size) {
  const cv::Mat image = read_image(file, size, cv::IMREAD_UNCHANGED);
  if (image.type() != CV_16UC1) {
    throw InputError(file.string() + ": has " + kind_of(image) +
                     ", a depth image has 1 channel of 16 bits (mm)");
  }
  return image;
}

cv::Mat read_label_image(const fs::path& file, cv::Size size) {
  const cv::Mat image = read_image(file, size, cv::IMREAD_UNCHANGED);
  if (image.type() != CV_8UC1 && image.type() != CV_16UC1) {
    throw InputError(file.string() + ": has " + kind_of(image) +
                     ", a segmentation image has 1 channel of 8 or 16 bits (class index)");
  }
  return image;
}

cv::Mat read_metre_image(const fs::path& file, cv::Size size) {
  // OpenCV reads this format only where the environment says so, for fear of untrusted files.
  static const bool allowed = ::setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 0) == 0;
  const cv::Mat image = allowed ? read_image(file, size, cv::IMREAD_UNCHANGED) : cv::Mat();
  if (image.depth() != CV_32F) {
    throw InputError(file.string() + ": has " + kind_of(image) +
                     ", a depth image in metres has floating-point numbers");
  }
  cv::Mat metres;
  cv::extractChannel(image, metres, 0);
  for (int v = 0; v < metres.rows; ++v) {
    float* row = metres.ptr<float>(v);
    for (int u = 0; u < metres.cols; ++u) {
      if (!std::isfinite(row[u])) row[u] = 0.0f;
    }
  }
  return metres;
}

cv::Mat read_id_image(const fs::path& file, cv::Size size) {
  const cv::Mat image = read_image(file, size, cv::IMREAD_UNCHANGED);
  if (image.channels() < 3 || image.elemSize1() > 2) return read_label_image(file, size);
  cv::Mat ids, other;
  cv::extractChannel(image, ids, 0);
  for (int channel = 1; channel < 3; ++channel) {
    cv::extractChannel(image, other, channel);
    if (cv::countNonZero(other != ids) > 0) {
      throw InputError(file.string() + ": is coloured; a mask has ids, as grey");
    }
  }
  return ids;
}

cv::Mat read_color_image(const fs::path& file, cv::Size size) {
  return read_image(file, size, cv::IMREAD_COLOR);
}

std::map<int, fs::path> numbered_files(const fs::path& folder, const std::string& prefix,
                                       const std::string& suffix) {
  std::map<int, fs::path> out;
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    if (!error || error == std::errc::no_such_file_or_directory) return out;
    throw InputError(folder.string() + ": cannot be read: " + error.message());
  }
  fs::directory_iterator entries(folder, error);
  if (error) throw InputError(folder.string() + ": cannot be read: " + error.message());
  for (const fs::directory_entry& entry : entries) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= prefix.size() + suffix.size()) continue;
    const std::string digits =
        name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
    const bool fits =
        name.compare(0, prefix.size(), prefix) == 0 &&
        name.compare(name.size() - suffix.size(), suffix.size(), suffix) == 0 &&
        digits.size() <= 9 &&
        std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c); });
    if (!fits || !entry.is_regular_file(error)) continue;
    const auto [place, fresh] = out.emplace(std::stoi(digits), entry.path());
    if (!fresh) {
      const auto [first, second] = std::minmax(place->second, entry.path());
      throw InputError(second.string() + ": has the same number as " + first.filename().string());
    }
  }
  return out;
}

void require_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::is_directory(folder, error)) return;
  const bool missing = !error || error == std::errc::no_such_file_or_directory;
  throw InputError(folder.string() +
                   (missing ? ": no such folder" : ": cannot be read: " + error.message()));
}

}  // namespace pocd

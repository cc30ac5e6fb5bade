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

cv::Mat read_image(const fs::path& file, int flags) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file.string() + ": cannot be read");
  const std::vector<unsigned char> bytes((std::istreambuf_iterator<char>(in)), {});
  if (bytes.empty()) throw InputError(file.string() + ": file is empty");
  require_whole(bytes, file);
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

cv::Mat read_depth_image(const fs::path& file) {
  const cv::Mat image = read_image(file, cv::IMREAD_UNCHANGED);
  if (image.type() != CV_16UC1) {
    throw InputError(file.string() + ": has " + kind_of(image) +
                     ", a depth image has 1 channel of 16 bits (mm)");
  }
  return image;
}

cv::Mat read_label_image(const fs::path& file) {
  const cv::Mat image = read_image(file, cv::IMREAD_UNCHANGED);
  if (image.type() != CV_8UC1 && image.type() != CV_16UC1) {
    throw InputError(file.string() + ": has " + kind_of(image) +
                     ", a segmentation image has 1 channel of 8 or 16 bits (class index)");
  }
  return image;
}

cv::Mat read_metre_image(const fs::path& file) {
  // OpenCV reads this format only where the environment says so, for fear of untrusted files.
  static const bool allowed = ::setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 0) == 0;
  const cv::Mat image = allowed ? read_image(file, cv::IMREAD_UNCHANGED) : cv::Mat();
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

cv::Mat read_id_image(const fs::path& file) {
  const cv::Mat image = read_image(file, cv::IMREAD_UNCHANGED);
  if (image.channels() < 3 || image.elemSize1() > 2) return read_label_image(file);
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

cv::Mat read_color_image(const fs::path& file) { return read_image(file, cv::IMREAD_COLOR); }

std::map<int, fs::path> numbered_files(const fs::path& folder, const std::string& prefix,
                                       const std::string& suffix) {
  std::map<int, fs::path> out;
  if (!fs::is_directory(folder)) return out;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= prefix.size() + suffix.size()) continue;
    const std::string digits =
        name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
    const bool fits =
        name.compare(0, prefix.size(), prefix) == 0 &&
        name.compare(name.size() - suffix.size(), suffix.size(), suffix) == 0 &&
        digits.size() <= 9 &&
        std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c); });
    if (!fits) continue;
    const auto [place, fresh] = out.emplace(std::stoi(digits), entry.path());
    if (!fresh) {
      const auto [first, second] = std::minmax(place->second, entry.path());
      throw InputError(second.string() + ": has the same number as " + first.filename().string());
    }
  }
  return out;
}

void require_folder(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw InputError(folder.string() + ": no such folder");
}

}  // namespace pocd

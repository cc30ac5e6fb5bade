#include "pcd_file.hpp"

#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "pocd/common/check.hpp"
#include "pocd/input/camera_model.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

/// What a header says of the size of its points.
struct Layout {
  std::uint64_t width = 0, height = 0, points = 0, point_bytes = 0;
};

/// The words of a line, which blanks or tabs part.
std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  return {std::istream_iterator<std::string>(in), {}};
}

/// The words after the first one, all of which must be whole numbers.
std::vector<std::uint64_t> numbers_of(const std::vector<std::string>& words, const fs::path& file) {
  std::vector<std::uint64_t> numbers;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::string& word = words[i];
    std::uint64_t number = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || stop != word.data() + word.size() || number > 0xFFFFFFFFu) {
      throw InputError(file.string() + ": " + words[0] + " is \"" + word +
                       "\", expected a whole number");
    }
    numbers.push_back(number);
  }
  if (numbers.empty()) throw InputError(file.string() + ": " + words[0] + " has no value");
  return numbers;
}

/// PCL makes room for all points by the sizes in the header and maps the file by them: a header
/// could take all memory, and a file that is shorter than that would end the process with a bus
/// error. So the sizes are checked before.
void require_whole(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file.string() + ": cannot be read");
  std::string line, data;
  std::map<std::string, std::vector<std::uint64_t>> header{
      {"SIZE", {}}, {"COUNT", {}}, {"WIDTH", {}}, {"HEIGHT", {}}, {"POINTS", {}}};
  for (int i = 0; i < 64 && data.empty() && std::getline(in, line); ++i) {
    const std::vector<std::string> words = words_of(line);
    if (words.empty()) continue;
    if (const auto entry = header.find(words[0]); entry != header.end())
      entry->second = numbers_of(words, file);
    if (words[0] == "DATA") data = words.size() > 1 ? words[1] : "?";
  }
  if (data.empty()) throw InputError(file.string() + ": has no PCD header");
  for (const char* key : {"SIZE", "WIDTH", "HEIGHT", "POINTS"}) {
    if (header.at(key).empty()) throw InputError(file.string() + ": header has no " + key);
  }
  const std::vector<std::uint64_t>&sizes = header.at("SIZE"), &counts = header.at("COUNT");
  Layout layout;
  layout.width = header.at("WIDTH")[0];
  layout.height = header.at("HEIGHT")[0];
  layout.points = header.at("POINTS")[0];
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const std::uint64_t count = i < counts.size() ? counts[i] : 1;
    if (sizes[i] > 8 || count > 64) {
      throw InputError(file.string() + ": has a field of " + std::to_string(sizes[i]) + " x " +
                       std::to_string(count) + " bytes");
    }
    layout.point_bytes += sizes[i] * count;
  }
  if (layout.width > kLargestSide_px || layout.height > kLargestSide_px ||
      layout.points != layout.width * layout.height) {
    throw InputError(file.string() + ": is " + std::to_string(layout.width) + "x" +
                     std::to_string(layout.height) + " with " + std::to_string(layout.points) +
                     " points");
  }
  std::error_code error;
  const std::uint64_t file_bytes = fs::file_size(file, error);
  in.clear();  // the header may end the file
  const std::uint64_t begin = static_cast<std::uint64_t>(in.tellg());
  const std::uint64_t points = layout.width * layout.height;
  std::uint64_t needed = points * layout.point_bytes;
  if (data == "binary_compressed") {
    std::uint32_t compressed[2] = {0, 0};
    in.read(reinterpret_cast<char*>(compressed), sizeof compressed);
    // LZF makes at most 264 bytes of 3.
    needed = in ? std::max<std::uint64_t>(sizeof compressed + compressed[0], needed / 88)
                : file_bytes + 1;
  } else if (data != "binary") {
    needed = points * 2 * std::max<std::size_t>(sizes.size(), 1);  // a digit and a separator
  }
  if (error || file_bytes + 1 < begin + needed) {  // the last separator may be missing
    throw InputError(file.string() + ": file is shorter than its header says");
  }
}

/// Bytes of a number in a field; 0: no type that PCD knows.
std::size_t bytes_of(unsigned type) {
  switch (type) {
    case pcl::PCLPointField::INT8:
    case pcl::PCLPointField::UINT8:
      return 1;
    case pcl::PCLPointField::INT16:
    case pcl::PCLPointField::UINT16:
      return 2;
    case pcl::PCLPointField::INT32:
    case pcl::PCLPointField::UINT32:
    case pcl::PCLPointField::FLOAT32:
      return 4;
    case pcl::PCLPointField::INT64:
    case pcl::PCLPointField::UINT64:
    case pcl::PCLPointField::FLOAT64:
      return 8;
    default:
      return 0;
  }
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// The field `label` or `labels`, one number of any type; null when there is none.
const pcl::PCLPointField* label_field(const pcl::PCLPointCloud2& cloud, const fs::path& file) {
  for (const pcl::PCLPointField& field : cloud.fields) {
    const std::string name = lower(field.name);
    if (name != "label" && name != "labels") continue;
    const std::size_t bytes = bytes_of(field.datatype);
    if (bytes > 0 && field.count <= 1 && field.offset + bytes <= cloud.point_step) return &field;
    throw InputError(file.string() + ": field " + field.name + " has type " +
                     std::to_string(field.datatype) + " and count " + std::to_string(field.count) +
                     ", expected one number");
  }
  return nullptr;
}

/// A field of whole numbers that may be meant as labels; "" when there is none.
std::string like_labels(const pcl::PCLPointCloud2& cloud) {
  for (const pcl::PCLPointField& field : cloud.fields) {
    const std::string name = lower(field.name);
    for (const char* word : {"label", "class", "semantic", "segment", "instance", "object"}) {
      if (name.find(word) != std::string::npos) return field.name;
    }
  }
  return "";
}

/// A field of four bytes that lies within the point.
const pcl::PCLPointField* field_of(const pcl::PCLPointCloud2& cloud, const std::string& name,
                                   unsigned type) {
  for (const pcl::PCLPointField& field : cloud.fields) {
    if (field.name == name && field.datatype == type && field.offset + 4 <= cloud.point_step) {
      return &field;
    }
  }
  return nullptr;
}

pcl::PCLPointCloud2 load(const fs::path& file) {
  require_whole(file);
  pcl::PCLPointCloud2 cloud;
  // PCL reports on the console in its own words; the caller reports by the exception.
  const pcl::console::VERBOSITY_LEVEL level = pcl::console::getVerbosityLevel();
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  int result = -1;
  try {
    result = pcl::io::loadPCDFile(file.string(), cloud);
  } catch (const std::exception&) {
  }
  pcl::console::setVerbosityLevel(level);
  const std::size_t points = static_cast<std::size_t>(cloud.width) * cloud.height;
  if (result < 0 || points == 0 || cloud.data.size() < points * cloud.point_step) {
    throw InputError(file.string() + ": is no PCD file that can be read");
  }
  return cloud;
}

template <class T>
T value_at(const std::uint8_t* point, const pcl::PCLPointField* field) {
  T value;
  std::memcpy(&value, point + field->offset, sizeof value);
  return value;
}

/// The label of a point, whatever its type; what is no label (negative, not finite) is 0, invalid,
/// and one beyond 31 bits is the largest one.
std::uint32_t label_at(const std::uint8_t* point, const pcl::PCLPointField* field) {
  double value = 0.0;
  switch (field->datatype) {
    case pcl::PCLPointField::INT8:
      value = value_at<std::int8_t>(point, field);
      break;
    case pcl::PCLPointField::UINT8:
      value = value_at<std::uint8_t>(point, field);
      break;
    case pcl::PCLPointField::INT16:
      value = value_at<std::int16_t>(point, field);
      break;
    case pcl::PCLPointField::UINT16:
      value = value_at<std::uint16_t>(point, field);
      break;
    case pcl::PCLPointField::INT32:
      value = value_at<std::int32_t>(point, field);
      break;
    case pcl::PCLPointField::UINT32:
      value = value_at<std::uint32_t>(point, field);
      break;
    case pcl::PCLPointField::INT64:
      value = static_cast<double>(value_at<std::int64_t>(point, field));
      break;
    case pcl::PCLPointField::UINT64:
      value = static_cast<double>(value_at<std::uint64_t>(point, field));
      break;
    case pcl::PCLPointField::FLOAT32:
      value = static_cast<double>(value_at<float>(point, field));
      break;
    default:
      value = value_at<double>(point, field);
  }
  if (!std::isfinite(value) || value < 1.0) return 0;
  return static_cast<std::uint32_t>(std::min(value, 2147483647.0));
}

}  // namespace

PcdImages read_pcd(const fs::path& file) {
  const pcl::PCLPointCloud2 cloud = load(file);
  if (cloud.height < 2) throw InputError(file.string() + ": is not organised (height 1)");
  const auto* z = field_of(cloud, "z", pcl::PCLPointField::FLOAT32);
  if (!z || !field_of(cloud, "x", pcl::PCLPointField::FLOAT32) ||
      !field_of(cloud, "y", pcl::PCLPointField::FLOAT32)) {
    throw InputError(file.string() + ": has no float fields x y z");
  }
  const auto* label = label_field(cloud, file);
  const pcl::PCLPointField* color = nullptr;
  for (const char* name : {"rgba", "rgb"}) {
    for (const unsigned type : {pcl::PCLPointField::UINT32, pcl::PCLPointField::FLOAT32}) {
      if (!color) color = field_of(cloud, name, type);
    }
  }
  const int rows = static_cast<int>(cloud.height), cols = static_cast<int>(cloud.width);
  PcdImages out;
  if (!label) out.unread_labels = like_labels(cloud);
  out.depth_m.create(rows, cols, CV_32FC1);
  if (label) out.raw_labels.create(rows, cols, CV_32SC1);
  if (color) out.color.create(rows, cols, CV_8UC3);
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < cols; ++u) {
      const std::uint8_t* point =
          cloud.data.data() + (static_cast<std::size_t>(v) * cols + u) * cloud.point_step;
      const float depth = value_at<float>(point, z);
      const std::uint32_t id = label ? label_at(point, label) : 1;
      out.depth_m.at<float>(v, u) = std::isfinite(depth) && depth > 0.0f && id != 0 ? depth : 0.0f;
      if (label) out.raw_labels.at<std::int32_t>(v, u) = static_cast<std::int32_t>(id);
      if (color) {
        const std::uint32_t rgb = value_at<std::uint32_t>(point, color);
        out.color.at<cv::Vec3b>(v, u) =
            cv::Vec3b(rgb & 0xFF, (rgb >> 8) & 0xFF, (rgb >> 16) & 0xFF);
      }
    }
  }
  return out;
}

}  // namespace pocd

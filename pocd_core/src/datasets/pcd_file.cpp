#include "pcd_file.hpp"

#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <string>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

/// PCL maps the file into memory by the sizes in its header; a file shorter than that would end the
/// process with a bus error, so the size is checked before.
void require_whole(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file.string() + ": cannot be read");
  std::string line;
  bool found = false;
  for (int i = 0; i < 64 && !found && std::getline(in, line); ++i) {
    found = line.compare(0, 5, "DATA ") == 0;
  }
  if (!found) throw InputError(file.string() + ": has no PCD header");
  if (line.compare(0, 22, "DATA binary_compressed") != 0) return;
  const std::uint64_t begin = static_cast<std::uint64_t>(in.tellg());
  std::uint32_t sizes[2] = {0, 0};
  in.read(reinterpret_cast<char*>(sizes), sizeof sizes);
  if (!in || fs::file_size(file) < begin + sizeof sizes + sizes[0]) {
    throw InputError(file.string() + ": file is shorter than its header says");
  }
}

const pcl::PCLPointField* field_of(const pcl::PCLPointCloud2& cloud, const std::string& name,
                                   unsigned type) {
  for (const pcl::PCLPointField& field : cloud.fields) {
    if (field.name == name && (type == 0 || field.datatype == type)) return &field;
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

}  // namespace

PcdImages read_pcd(const fs::path& file) {
  const pcl::PCLPointCloud2 cloud = load(file);
  if (cloud.height < 2) throw InputError(file.string() + ": is not organised (height 1)");
  const auto* z = field_of(cloud, "z", pcl::PCLPointField::FLOAT32);
  if (!z || !field_of(cloud, "x", pcl::PCLPointField::FLOAT32) ||
      !field_of(cloud, "y", pcl::PCLPointField::FLOAT32)) {
    throw InputError(file.string() + ": has no float fields x y z");
  }
  const auto* label = field_of(cloud, "label", pcl::PCLPointField::UINT32);
  const auto* color = field_of(cloud, "rgba", 0);
  if (!color) color = field_of(cloud, "rgb", 0);
  const int rows = static_cast<int>(cloud.height), cols = static_cast<int>(cloud.width);
  PcdImages out;
  out.depth_m.create(rows, cols, CV_32FC1);
  if (label) out.raw_labels.create(rows, cols, CV_32SC1);
  if (color) out.color.create(rows, cols, CV_8UC3);
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < cols; ++u) {
      const std::uint8_t* point =
          cloud.data.data() + (static_cast<std::size_t>(v) * cols + u) * cloud.point_step;
      const float depth = value_at<float>(point, z);
      const std::uint32_t id = label ? value_at<std::uint32_t>(point, label) : 1;
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

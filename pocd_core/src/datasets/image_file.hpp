// Images of data sets. All throw InputError naming the file: missing, damaged, or of the wrong
// kind.
#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>

#include "pocd/input/camera_model.hpp"

namespace pocd {

/// What the images of a camera must have; a side of 0 may be anything.
inline cv::Size image_size(const CameraModel& camera) { return {camera.width, camera.height}; }

// PNG, JPEG or OpenEXR; `size` is checked before a pixel is decoded.

/// One channel of 16 bits, millimetres.
cv::Mat read_depth_image(const std::filesystem::path& file, cv::Size size);
/// One channel of 8 or 16 bits, class indices.
cv::Mat read_label_image(const std::filesystem::path& file, cv::Size size);
/// Floating-point image (OpenEXR), metres: the first channel; what is not finite is no return (0).
cv::Mat read_metre_image(const std::filesystem::path& file, cv::Size size);
/// Ids of 8 or 16 bits, as one channel or as grey in three.
cv::Mat read_id_image(const std::filesystem::path& file, cv::Size size);
/// As 8-bit BGR.
cv::Mat read_color_image(const std::filesystem::path& file, cv::Size size);

/// Regular files of a folder whose name is prefix + digits + suffix, by the number; empty when the
/// folder is missing. Throws InputError for two files with one number.
std::map<int, std::filesystem::path> numbered_files(const std::filesystem::path& folder,
                                                    const std::string& prefix,
                                                    const std::string& suffix);

/// Throws InputError unless `folder` is a folder.
void require_folder(const std::filesystem::path& folder);

}  // namespace pocd

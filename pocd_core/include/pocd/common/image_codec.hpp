// PNG and JPEG by Debian's libpng and libjpeg. OpenCV's module for image files would do the same,
// but it brings GDAL with it, and a hundred libraries behind that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include <opencv2/core/mat.hpp>

namespace pocd {

/// The picture as it is stored: grey of 8 or 16 bits (1, 2 and 4 bits are spread to 8), BGR or BGRA
/// of as many bits; grey with alpha and palettes become colours. Empty for anything that is no
/// whole PNG, and for one with a side beyond `largest_side_px`: a few bytes can announce a picture
/// that fills the memory. Says nothing on stderr. Thread-safe.
cv::Mat decode_png(const std::uint8_t* data, std::size_t size, int largest_side_px);

/// CV_8UC1 or CV_8UC3 (BGR), not turned as its camera may ask for. Empty for anything else, for one
/// of four inks, and for one that ends too early. As decode_png().
cv::Mat decode_jpeg(const std::uint8_t* data, std::size_t size, int largest_side_px);

/// Writes CV_8UC1, CV_16UC1, CV_8UC3 (BGR) or CV_8UC4 (BGRA) as PNG. InputError names the file that
/// cannot be written; std::logic_error for other types.
void write_png(const std::filesystem::path& file, const cv::Mat& picture);

}  // namespace pocd

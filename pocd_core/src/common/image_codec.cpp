#include "pocd/common/image_codec.hpp"

#include <csetjmp>
#include <cstdio>
// jpeglib.h needs what cstdio declares.
#include <jpeglib.h>
#include <png.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include <jerror.h>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// Both libraries leave by longjmp: nothing with a destructor lives in the functions that call them.

[[noreturn]] void leave_png(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void ignore_png(png_structp, png_const_charp) {}

struct Source {
  const std::uint8_t* data;
  std::size_t left;
};

void read_source(png_structp png, png_bytep out, png_size_t size) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (size > source->left) png_error(png, "the data ends");
  std::memcpy(out, source->data, size);
  source->data += size;
  source->left -= size;
}

struct PngReader {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, leave_png, ignore_png);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

/// What the pixels become.
bool read_png_header(PngReader& reader, Source& source, int& rows, int& cols, int& type) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_structp png = reader.png;
  png_set_read_fn(png, &source, read_source);
  png_read_info(png, reader.info);
  const int color = png_get_color_type(png, reader.info);
  const int bits = png_get_bit_depth(png, reader.info);
  const bool has_clear = png_get_valid(png, reader.info, PNG_INFO_tRNS) != 0;
  int channels = 1;
  if (color & PNG_COLOR_MASK_ALPHA) {
    channels = 4;
  } else if (color & PNG_COLOR_MASK_COLOR) {
    channels = has_clear ? 4 : 3;
  }
  if (bits == 16) png_set_swap(png);
  if (channels == 4 && has_clear) png_set_tRNS_to_alpha(png);
  if (color == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
  if (!(color & PNG_COLOR_MASK_COLOR) && bits < 8) png_set_expand_gray_1_2_4_to_8(png);
  if (color & PNG_COLOR_MASK_COLOR) {
    png_set_bgr(png);
  } else if (channels == 4) {
    png_set_gray_to_rgb(png);
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, reader.info);
  rows = static_cast<int>(png_get_image_height(png, reader.info));
  cols = static_cast<int>(png_get_image_width(png, reader.info));
  type = CV_MAKETYPE(bits == 16 ? CV_16U : CV_8U, channels);
  return true;
}

bool read_png_rows(PngReader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

std::vector<png_bytep> row_pointers(const cv::Mat& picture) {
  std::vector<png_bytep> rows(static_cast<std::size_t>(picture.rows));
  for (int row = 0; row < picture.rows; ++row) {
    rows[static_cast<std::size_t>(row)] = const_cast<png_bytep>(picture.ptr(row));
  }
  return rows;
}

struct JpegReader {
  jpeg_decompress_struct jpeg;
  jpeg_error_mgr errors;
  std::jmp_buf out;
  bool cut_off = false;
};

[[noreturn]] void leave_jpeg(j_common_ptr jpeg) {
  std::longjmp(static_cast<JpegReader*>(jpeg->client_data)->out, 1);
}
/// Level -1 is damage after which the library goes on. Stray bytes between markers, which cameras
/// are known to send, change no pixel.
void note_jpeg(j_common_ptr jpeg, int level) {
  if (level >= 0) return;
  const int code = jpeg->err->msg_code;
  if (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER) {
    static_cast<JpegReader*>(jpeg->client_data)->cut_off = true;
  }
}

bool start_jpeg(JpegReader& reader, const std::uint8_t* data, std::size_t size) {
  reader.jpeg.err = jpeg_std_error(&reader.errors);
  reader.errors.error_exit = leave_jpeg;
  reader.errors.emit_message = note_jpeg;
  reader.jpeg.client_data = &reader;
  if (setjmp(reader.out)) return false;
  jpeg_create_decompress(&reader.jpeg);
  jpeg_mem_src(&reader.jpeg, data, static_cast<unsigned long>(size));
  jpeg_read_header(&reader.jpeg, TRUE);
  if (reader.jpeg.num_components != 1 && reader.jpeg.num_components != 3) return false;
  reader.jpeg.out_color_space = reader.jpeg.num_components == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
  jpeg_start_decompress(&reader.jpeg);
  return true;
}

bool read_jpeg_rows(JpegReader& reader, JSAMPARRAY rows) {
  if (setjmp(reader.out)) return false;
  while (reader.jpeg.output_scanline < reader.jpeg.output_height) {
    jpeg_read_scanlines(&reader.jpeg, rows + reader.jpeg.output_scanline, 1);
  }
  jpeg_finish_decompress(&reader.jpeg);
  return true;
}

struct PngWriter {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, leave_png, ignore_png);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
};

bool write_png_rows(PngWriter& writer, std::FILE* file, const cv::Mat& picture, png_bytepp rows) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  const int channels = picture.channels();
  const int color = channels == 1   ? PNG_COLOR_TYPE_GRAY
                    : channels == 3 ? PNG_COLOR_TYPE_RGB
                                    : PNG_COLOR_TYPE_RGB_ALPHA;
  png_init_io(writer.png, file);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(picture.cols),
               static_cast<png_uint_32>(picture.rows), picture.depth() == CV_16U ? 16 : 8, color,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  // Fast, and small enough for drawings and depth: as OpenCV's writer has it.
  png_set_compression_level(writer.png, 1);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_write_info(writer.png, writer.info);
  png_set_bgr(writer.png);
  png_set_swap(writer.png);
  png_write_image(writer.png, rows);
  png_write_end(writer.png, writer.info);
  return true;
}

}  // namespace

cv::Mat decode_png(const std::uint8_t* data, std::size_t size, int largest_side_px) {
  PngReader reader;
  Source source{data, size};
  int rows = 0, cols = 0, type = 0;
  if (!reader.info || !read_png_header(reader, source, rows, cols, type)) return {};
  if (std::max(rows, cols) > largest_side_px) return {};
  cv::Mat picture(rows, cols, type);
  std::vector<png_bytep> pointers = row_pointers(picture);
  return read_png_rows(reader, pointers.data()) ? picture : cv::Mat();
}

cv::Mat decode_jpeg(const std::uint8_t* data, std::size_t size, int largest_side_px) {
  JpegReader reader{};
  cv::Mat picture;
  const auto largest = static_cast<JDIMENSION>(largest_side_px);
  if (start_jpeg(reader, data, size) && reader.jpeg.output_height <= largest &&
      reader.jpeg.output_width <= largest) {
    picture.create(static_cast<int>(reader.jpeg.output_height),
                   static_cast<int>(reader.jpeg.output_width),
                   reader.jpeg.num_components == 1 ? CV_8UC1 : CV_8UC3);
    std::vector<JSAMPROW> rows = row_pointers(picture);
    if (!read_jpeg_rows(reader, rows.data()) || reader.cut_off) picture.release();
  }
  jpeg_destroy_decompress(&reader.jpeg);
  return picture;
}

void write_png(const std::filesystem::path& file, const cv::Mat& picture) {
  const int type = picture.type();
  POCD_CHECK(!picture.empty() &&
             (type == CV_8UC1 || type == CV_16UC1 || type == CV_8UC3 || type == CV_8UC4));
  std::vector<png_bytep> rows = row_pointers(picture);
  PngWriter writer;
  std::FILE* out = std::fopen(file.c_str(), "wb");
  bool good = out && writer.info && write_png_rows(writer, out, picture, rows.data());
  if (out) good = std::fclose(out) == 0 && good;
  if (!good) throw InputError(file.string() + ": picture cannot be written");
}

}  // namespace pocd

#include "compression.hpp"

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <memory>

#include "../common/parameter_text.hpp"
#include "pocd/common/check.hpp"

namespace pocd::recording {
namespace {

/// Output of a size that the input only announces: what is not plausible is made as it fills, so
/// that a few damaged bytes do not cost hundreds of megabytes.
class Output {
 public:
  Output(std::size_t in_size, std::size_t announced)
      : announced_(announced),
        bytes_(std::min(announced, kAtOnce + std::min(in_size, announced) * kPlausible)) {}

  std::uint8_t* here() { return bytes_.data() + filled_; }
  std::size_t room() const { return bytes_.size() - filled_; }
  void fill(std::size_t count) {
    filled_ += count;
    if (room() == 0) bytes_.resize(std::min(announced_, 2 * bytes_.size()));
  }
  Bytes take(const std::string& name) {
    if (filled_ != announced_) {
      throw DamagedData(0, name + ": gives " + std::to_string(filled_) + " bytes, " +
                               std::to_string(announced_) + " announced");
    }
    return std::move(bytes_);
  }

 private:
  static constexpr std::size_t kAtOnce = 65536, kPlausible = 64;
  std::size_t announced_, filled_ = 0;
  Bytes bytes_;
};

/// Runs `step` (in, its size, out, its size; both become what was used; gives what is still wanted,
/// 0 at the end of a frame) over the input.
template <class Step>
Bytes decompress_by(const std::string& name, const std::uint8_t* data, std::size_t size,
                    std::size_t announced, const Step& step) {
  if (size == 0 && announced == 0) return {};
  Output out(size, announced);
  std::size_t at = 0;
  for (std::size_t wanted = 1; wanted != 0 || at < size;) {
    std::size_t in_step = size - at, out_step = out.room();
    wanted = step(data + at, in_step, out.here(), out_step, at);
    at += in_step;
    out.fill(out_step);
    if (in_step == 0 && out_step == 0 && (wanted != 0 || at < size)) {
      throw DamagedData(at, name + ": data ends early or is longer than announced");
    }
  }
  return out.take(name);
}

Bytes decompress_lz4(const std::uint8_t* data, std::size_t size, std::size_t announced) {
  LZ4F_dctx* raw = nullptr;
  POCD_CHECK(!LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)));
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, &LZ4F_freeDecompressionContext);
  return decompress_by("lz4", data, size, announced,
                       [&](const std::uint8_t* in, std::size_t& in_size, std::uint8_t* out,
                           std::size_t& out_size, std::size_t at) {
                         const std::size_t wanted =
                             LZ4F_decompress(context.get(), out, &out_size, in, &in_size, nullptr);
                         if (LZ4F_isError(wanted)) {
                           throw DamagedData(at, std::string("lz4: ") + LZ4F_getErrorName(wanted));
                         }
                         return wanted;
                       });
}

Bytes decompress_zstd(const std::uint8_t* data, std::size_t size, std::size_t announced) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  POCD_CHECK(stream != nullptr);
  return decompress_by("zstd", data, size, announced,
                       [&](const std::uint8_t* in, std::size_t& in_size, std::uint8_t* out,
                           std::size_t& out_size, std::size_t at) {
                         ZSTD_inBuffer input{in, in_size, 0};
                         ZSTD_outBuffer output{out, out_size, 0};
                         const std::size_t wanted =
                             ZSTD_decompressStream(stream.get(), &output, &input);
                         if (ZSTD_isError(wanted)) {
                           throw DamagedData(at, std::string("zstd: ") + ZSTD_getErrorName(wanted));
                         }
                         in_size = input.pos;
                         out_size = output.pos;
                         return wanted;
                       });
}

}  // namespace

std::uint32_t crc32_of(const std::uint8_t* data, std::size_t size, std::uint32_t crc) {
  uLong value = crc;
  while (size > 0) {
    const auto step =
        static_cast<uInt>(std::min<std::size_t>(size, std::numeric_limits<uInt>::max()));
    value = ::crc32(value, data, step);
    data += step;
    size -= step;
  }
  return static_cast<std::uint32_t>(value);
}

std::string mcap_name(ChunkCompression compression) {
  return compression == ChunkCompression::kNone ? "" : word_of(compression);
}

std::optional<ChunkCompression> compression_named(const std::string& name) {
  for (const auto& entry : words_of(ChunkCompression{})) {
    if (name == mcap_name(entry.first)) return entry.first;
  }
  return std::nullopt;
}

void compress(ChunkCompression compression, int level, const Bytes& in, Bytes& out) {
  std::size_t size = 0;
  switch (compression) {
    case ChunkCompression::kNone:
      out = in;
      return;
    case ChunkCompression::kLz4:
      out.resize(LZ4F_compressFrameBound(in.size(), nullptr));
      size = LZ4F_compressFrame(out.data(), out.size(), in.data(), in.size(), nullptr);
      POCD_CHECK(!LZ4F_isError(size));
      out.resize(size);
      return;
    case ChunkCompression::kZstd:
      out.resize(ZSTD_compressBound(in.size()));
      size = ZSTD_compress(out.data(), out.size(), in.data(), in.size(), level);
      POCD_CHECK(!ZSTD_isError(size));
      out.resize(size);
      return;
  }
  throw InputError("compression " +
                   config_detail::not_one_of(word_of(compression), choices_of<ChunkCompression>()));
}

Bytes decompress(const std::string& compression, const std::uint8_t* data, std::size_t size,
                 std::size_t out_size) {
  const std::optional<ChunkCompression> known = compression_named(compression);
  if (!known) throw DamagedData(0, "compression '" + compression.substr(0, 32) + "' is unknown");
  if (known == ChunkCompression::kZstd) return decompress_zstd(data, size, out_size);
  if (known == ChunkCompression::kLz4) return decompress_lz4(data, size, out_size);
  if (size != out_size) {
    throw DamagedData(0, "not compressed, but has " + std::to_string(size) + " bytes where " +
                             std::to_string(out_size) + " are announced");
  }
  return Bytes(data, data + size);
}

namespace {

bool begins_with(const std::uint8_t* data, std::size_t size, const std::uint8_t (&magic)[4]) {
  return size >= sizeof magic && std::equal(std::begin(magic), std::end(magic), data);
}

}  // namespace

bool is_zstd(const std::uint8_t* data, std::size_t size) {
  return begins_with(data, size, {0x28, 0xB5, 0x2F, 0xFD});
}

bool is_lz4(const std::uint8_t* data, std::size_t size) {
  return begins_with(data, size, {0x04, 0x22, 0x4D, 0x18});
}

Bytes decompress_message(const std::uint8_t* data, std::size_t size, std::size_t most) {
  const unsigned long long content = ZSTD_getFrameContentSize(data, size);
  if (content == ZSTD_CONTENTSIZE_ERROR) throw DamagedData(0, "zstd: no frame");
  if (content != ZSTD_CONTENTSIZE_UNKNOWN && content <= most) {
    return decompress_zstd(data, size, static_cast<std::size_t>(content));
  }
  // Written as a stream: the size shows at the end only.
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  POCD_CHECK(stream != nullptr);
  Bytes out;
  ZSTD_inBuffer input{data, size, 0};
  for (std::size_t wanted = 1; wanted != 0;) {
    const std::size_t before = out.size(), in_before = input.pos;
    out.resize(before + ZSTD_DStreamOutSize());
    ZSTD_outBuffer output{out.data() + before, out.size() - before, 0};
    wanted = ZSTD_decompressStream(stream.get(), &output, &input);
    if (ZSTD_isError(wanted)) {
      throw DamagedData(input.pos, std::string("zstd: ") + ZSTD_getErrorName(wanted));
    }
    out.resize(before + output.pos);
    if (out.size() > most) throw DamagedData(0, "zstd: the message is too large");
    if (wanted != 0 && output.pos == 0 && input.pos == in_before) {
      throw DamagedData(input.pos, "zstd: data ends early");
    }
  }
  return out;
}

}  // namespace pocd::recording

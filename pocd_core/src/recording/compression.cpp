#include "compression.hpp"

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "pocd/common/check.hpp"

namespace pocd::recording {
namespace {

Bytes decompress_lz4(const std::uint8_t* data, std::size_t size, std::size_t out_size) {
  LZ4F_dctx* raw = nullptr;
  POCD_CHECK(!LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)));
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, &LZ4F_freeDecompressionContext);
  Bytes out(out_size);
  std::size_t in_at = 0, out_at = 0;
  // A frame that is over asks for no more input; a full output cannot take any.
  for (std::size_t wanted = 1; wanted != 0;) {
    std::size_t in_step = size - in_at, out_step = out_size - out_at;
    wanted = LZ4F_decompress(context.get(), out.data() + out_at, &out_step, data + in_at, &in_step,
                             nullptr);
    if (LZ4F_isError(wanted)) {
      throw DamagedData(in_at, std::string("lz4: ") + LZ4F_getErrorName(wanted));
    }
    in_at += in_step;
    out_at += out_step;
    if (wanted != 0 && in_step == 0 && out_step == 0) {
      throw DamagedData(in_at, "lz4: data ends early or is longer than announced");
    }
  }
  if (out_at != out_size) {
    throw DamagedData(0, "lz4: gives " + std::to_string(out_at) + " bytes, " +
                             std::to_string(out_size) + " announced");
  }
  return out;
}

Bytes decompress_zstd(const std::uint8_t* data, std::size_t size, std::size_t out_size) {
  Bytes out(out_size);
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), data, size);
  if (ZSTD_isError(got)) throw DamagedData(0, std::string("zstd: ") + ZSTD_getErrorName(got));
  if (got != out_size) {
    throw DamagedData(0, "zstd: gives " + std::to_string(got) + " bytes, " +
                             std::to_string(out_size) + " announced");
  }
  return out;
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

void compress(const std::string& compression, int level, const Bytes& in, Bytes& out) {
  if (compression.empty()) {
    out = in;
  } else if (compression == "zstd") {
    out.resize(ZSTD_compressBound(in.size()));
    const std::size_t size = ZSTD_compress(out.data(), out.size(), in.data(), in.size(), level);
    POCD_CHECK(!ZSTD_isError(size));
    out.resize(size);
  } else if (compression == "lz4") {
    out.resize(LZ4F_compressFrameBound(in.size(), nullptr));
    const std::size_t size =
        LZ4F_compressFrame(out.data(), out.size(), in.data(), in.size(), nullptr);
    POCD_CHECK(!LZ4F_isError(size));
    out.resize(size);
  } else {
    throw InputError("compression '" + compression + "' is unknown, one of: none, lz4, zstd");
  }
}

Bytes decompress(const std::string& compression, const std::uint8_t* data, std::size_t size,
                 std::size_t out_size) {
  if (compression == "zstd") return decompress_zstd(data, size, out_size);
  if (compression == "lz4") return decompress_lz4(data, size, out_size);
  if (!compression.empty()) {
    throw DamagedData(0, "compression '" + compression.substr(0, 32) + "' is unknown");
  }
  if (size != out_size) {
    throw DamagedData(0, "not compressed, but has " + std::to_string(size) + " bytes where " +
                             std::to_string(out_size) + " are announced");
  }
  return Bytes(data, data + size);
}

}  // namespace pocd::recording

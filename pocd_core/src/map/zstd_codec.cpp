#include "zstd_codec.hpp"

#include <zstd.h>

#include <memory>

#include "pocd/common/check.hpp"

namespace pocd {

std::vector<std::uint8_t> compress(const std::vector<std::uint8_t>& raw, int level) {
  // A context costs more than a tile: one per thread is kept.
  thread_local const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(),
                                                                                  &ZSTD_freeCCtx);
  // So is the room for the worst case: what is returned has only the bytes it needs, because many
  // thousands of it are held.
  thread_local std::vector<std::uint8_t> room;
  const std::size_t bound = ZSTD_compressBound(raw.size());
  if (room.size() < bound) room.resize(bound);
  const std::size_t size =
      ZSTD_compressCCtx(context.get(), room.data(), room.size(), raw.data(), raw.size(), level);
  POCD_CHECK(!ZSTD_isError(size));
  return {room.data(), room.data() + size};
}

std::vector<std::uint8_t> decompress(const std::uint8_t* data, std::size_t size, std::size_t limit,
                                     const std::string& source) {
  const unsigned long long content = ZSTD_getFrameContentSize(data, size);
  if (content == ZSTD_CONTENTSIZE_ERROR) throw InputError(source + ": not a zstd frame");
  if (content == ZSTD_CONTENTSIZE_UNKNOWN || content > limit) {
    throw InputError(source + ": zstd frame declares no size or more than " +
                     std::to_string(limit) + " bytes");
  }
  if (ZSTD_findFrameCompressedSize(data, size) != size) {
    throw InputError(source + ": zstd frame is cut short or followed by other bytes");
  }
  thread_local const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                                  &ZSTD_freeDCtx);
  std::vector<std::uint8_t> out(static_cast<std::size_t>(content));
  const std::size_t written =
      ZSTD_decompressDCtx(context.get(), out.data(), out.size(), data, size);
  if (ZSTD_isError(written)) {
    throw InputError(source + ": damaged zstd frame (" + ZSTD_getErrorName(written) + ")");
  }
  if (written != out.size()) throw InputError(source + ": zstd frame is shorter than declared");
  return out;
}

}  // namespace pocd

#include "zstd_codec.hpp"

#include <zstd.h>

#include <memory>

#include "pocd/common/check.hpp"

namespace pocd {

namespace {

// A context costs more than a tile: one per thread is kept.
ZSTD_CCtx* context() {
  thread_local const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> kept(ZSTD_createCCtx(),
                                                                               &ZSTD_freeCCtx);
  return kept.get();
}

// So is the room for the worst case: what is returned has only the bytes it needs, because many
// thousands of it are held.
std::vector<std::uint8_t>& room_for(std::size_t bytes) {
  thread_local std::vector<std::uint8_t> room;
  if (room.size() < bytes) room.resize(bytes);
  return room;
}

}  // namespace

std::vector<std::uint8_t> compress(const std::vector<std::uint8_t>& raw, int level) {
  std::vector<std::uint8_t>& room = room_for(ZSTD_compressBound(raw.size()));
  const std::size_t size =
      ZSTD_compressCCtx(context(), room.data(), room.size(), raw.data(), raw.size(), level);
  POCD_CHECK(!ZSTD_isError(size));
  return {room.data(), room.data() + size};
}

std::vector<std::uint8_t> compress(const std::vector<std::uint8_t>& raw, int level,
                                   const std::vector<std::size_t>& ends) {
  constexpr std::size_t kBlockHead = 3;
  std::vector<std::uint8_t>& room =
      room_for(ZSTD_compressBound(raw.size()) + kBlockHead * (ends.size() + 1));
  ZSTD_CCtx* const zstd = context();
  const auto checked = [](std::size_t result) {
    POCD_CHECK(!ZSTD_isError(result));
    return result;
  };
  checked(ZSTD_CCtx_reset(zstd, ZSTD_reset_session_and_parameters));
  checked(ZSTD_CCtx_setParameter(zstd, ZSTD_c_compressionLevel, level));
  // Sections of a few kB whose codes save bytes and whose repetitions do not: a small table of
  // places to look at is as good, and half the time.
  checked(ZSTD_CCtx_setParameter(zstd, ZSTD_c_hashLog, 8));
  checked(ZSTD_CCtx_setPledgedSrcSize(zstd, raw.size()));
  ZSTD_outBuffer out{room.data(), room.size(), 0};
  ZSTD_inBuffer in{raw.data(), 0, 0};
  for (const std::size_t end : ends) {
    if (end == in.size || end >= raw.size()) continue;
    POCD_CHECK(end > in.size);
    in.size = end;
    // There is room for all of it: one call each.
    POCD_CHECK(checked(ZSTD_compressStream2(zstd, &out, &in, ZSTD_e_flush)) == 0);
  }
  in.size = raw.size();
  POCD_CHECK(checked(ZSTD_compressStream2(zstd, &out, &in, ZSTD_e_end)) == 0);
  return {room.data(), room.data() + out.pos};
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

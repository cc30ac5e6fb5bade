// decode_tile against bytes that are no tile.
#include <gtest/gtest.h>
#include <zstd.h>

#include <functional>
#include <string>

#include "map_fixtures.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/map_delta.hpp"

namespace pocd::testing {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes pack(const Bytes& raw) {
  Bytes out(ZSTD_compressBound(raw.size()));
  out.resize(ZSTD_compress(out.data(), out.size(), raw.data(), raw.size(), 1));
  return out;
}

Bytes unpack(const Bytes& payload) {
  Bytes out(ZSTD_getFrameContentSize(payload.data(), payload.size()));
  out.resize(ZSTD_decompress(out.data(), out.size(), payload.data(), payload.size()));
  return out;
}

// Two observed voxels, 0 and 9; the second belongs to object 0x01020304.
Bytes small_tile() {
  Bytes raw{'P', 'T', '1', 0, 1, 0, 2, 0, 4, 3, 2, 1};
  raw.resize(12 + 512, 0);
  raw[12] = 1;
  raw[13] = 2;
  for (const int byte : {127, 256 - 64, 0, 1}) raw.push_back(static_cast<std::uint8_t>(byte));
  return raw;
}

std::string error_of(const Bytes& payload) {
  try {
    decode_tile(payload, 0.2);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(TileDecode, DocumentedBytesAreUnderstood) {
  const DecodedTile tile = decode_tile(pack(small_tile()), 0.2);
  EXPECT_EQ(tile.observed[0], 1);
  EXPECT_EQ(tile.observed[1], 0);
  EXPECT_EQ(tile.observed[9], 1);
  EXPECT_FLOAT_EQ(tile.distance_m[0], 0.2f);
  EXPECT_FLOAT_EQ(tile.distance_m[9], static_cast<float>(-64 * 0.2 / 127));
  EXPECT_EQ(tile.owner[0], 0u);
  EXPECT_EQ(tile.owner[9], 0x01020304u);
}

TEST(TileDecode, EachDefectIsNamed) {
  const auto broken = [](const std::function<void(Bytes&)>& change) {
    Bytes raw = small_tile();
    change(raw);
    return error_of(pack(raw));
  };
  const auto says = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_PRED2(says, error_of({}), "map tile: not a zstd frame");
  EXPECT_PRED2(says, error_of({1, 2, 3, 4}), "not a zstd frame");
  EXPECT_PRED2(says, error_of(pack(Bytes(40000, 0))), "more than");
  EXPECT_PRED2(says, error_of(pack({1, 2})), "header");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[2] = '2'; }), "header");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[4] = 2; }), "do not fit");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[6] = 3; }), "do not fit");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[6] = 0; }), "counts");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[7] = 0x20; }), "counts");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[8] = b[9] = b[10] = b[11] = 0; }), "ascending");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[14] = 1; }), "more observed");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[13] = 0; }), "fewer observed");
  EXPECT_PRED2(says, broken([](Bytes& b) { b[12 + 512] = 0x80; }), "distance");
  EXPECT_PRED2(says, broken([](Bytes& b) { b.back() = 2; }), "owner index");
  Bytes cut = pack(small_tile());
  cut.pop_back();
  EXPECT_PRED2(says, error_of(cut), "cut short");
  Bytes longer = pack(small_tile());
  longer.push_back(0);
  EXPECT_PRED2(says, error_of(longer), "other bytes");
}

// Any bytes either decode or are rejected with InputError; nothing else may happen (the sanitizer
// build of this test watches memory).
TEST(TileDecode, RandomBytesAreDecodedOrRejected) {
  const TsdfConfig config = coarse_config();
  TsdfMap map(config);
  ThreadPool pool(1);
  for (const Pose& pose : arc_of_poses(4, 8)) {
    map.integrate(look({2.5, {{{0, 1.5, 1.0}, 0.3, 7}}}, pose).input(), pool);
  }
  MapPublisher publisher(1, config);
  publisher.update(map);
  const Bytes& payload = publisher.tiles().begin()->second.payload;
  const Bytes content = unpack(payload);
  Random random(99);
  int rejected = 0;
  for (int run = 0; run < 6000; ++run) {
    Bytes bytes = run % 3 == 0 ? payload : content;
    if (run % 3 == 2) {
      bytes.assign(random.below(3000), 0);
      for (auto& b : bytes) b = static_cast<std::uint8_t>(random.next());
    } else {
      for (std::uint64_t n = 1 + random.below(5); n-- > 0;) {
        bytes[random.below(bytes.size())] = static_cast<std::uint8_t>(random.next());
      }
      if (random.uniform() < 0.5) bytes.resize(random.below(bytes.size()));
    }
    if (run % 3 != 0) bytes = pack(bytes);
    rejected += !error_of(bytes).empty();
  }
  EXPECT_GT(rejected, 3000);
}

}  // namespace
}  // namespace pocd::testing

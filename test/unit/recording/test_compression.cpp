// What compressed bytes announce is not believed before it is there.
#include "compression.hpp"

#include <gtest/gtest.h>

#include "pocd/common/random.hpp"

namespace pocd::recording {
namespace {

class Compression : public testing::TestWithParam<ChunkCompression> {};

std::string error_of(ChunkCompression compression, const Bytes& data, std::size_t announced) {
  try {
    decompress(mcap_name(compression), data.data(), data.size(), announced);
  } catch (const DamagedData& damage) {
    return damage.what();
  }
  return "";
}

TEST_P(Compression, GivesBackWhatItTook) {
  Random random(7);
  Bytes noise(300'000);
  for (auto& byte : noise) byte = static_cast<std::uint8_t>(random.below(256));
  // The zeros are a thousand times smaller than announced.
  for (const Bytes& bytes : {Bytes{}, Bytes{1}, noise, Bytes(20'000'000, 0)}) {
    Bytes small;
    compress(GetParam(), 1, bytes, small);
    EXPECT_TRUE(decompress(mcap_name(GetParam()), small.data(), small.size(), bytes.size()) ==
                bytes);
    EXPECT_NE(error_of(GetParam(), small, bytes.size() + 1), "") << bytes.size();
    if (bytes.empty()) continue;
    EXPECT_NE(error_of(GetParam(), small, bytes.size() - 1), "") << bytes.size();
    small.resize(small.size() / 2);
    EXPECT_NE(error_of(GetParam(), small, bytes.size()), "") << bytes.size();
  }
}

// More than any machine has: what is announced is not made room for.
TEST_P(Compression, GarbageThatAnnouncesMuchCostsNothing) {
  const Bytes garbage(60, 0xA5);
  EXPECT_NE(error_of(GetParam(), garbage, std::size_t{1} << 62), "");
  Bytes small;
  compress(GetParam(), 1, Bytes(100, 7), small);
  EXPECT_NE(error_of(GetParam(), small, std::size_t{1} << 62), "");
}

INSTANTIATE_TEST_SUITE_P(Each, Compression,
                         testing::Values(ChunkCompression::kZstd, ChunkCompression::kLz4));

}  // namespace
}  // namespace pocd::recording

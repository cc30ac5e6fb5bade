#include "pocd/common/recent_map.hpp"

#include <gtest/gtest.h>

namespace pocd {
namespace {

constexpr StampNs kSecond = 1'000'000'000;

TEST(RecentMap, KeepsWhatIsAskedFor) {
  RecentMap<int> map(10 * kSecond);
  EXPECT_TRUE(map.at("a", 0).second);
  map.at("a", 0).first = 7;
  for (int s = 0; s < 100; s += 9) EXPECT_EQ(map.at("a", s * kSecond).first, 7);
  EXPECT_FALSE(map.at("a", 99 * kSecond).second);
  const auto [value, fresh] = map.at("a", 200 * kSecond);
  EXPECT_TRUE(fresh) << "not asked for in 100 s";
  EXPECT_EQ(value, 0);
  EXPECT_TRUE(map.at("a", 20 * kSecond).second) << "clocks were set back";
}

TEST(RecentMap, IsBoundedWhateverNamesCome) {
  RecentMap<int> short_lived(10 * kSecond), many(1000000 * kSecond, 50);
  for (int i = 0; i < 5000; ++i) {
    const std::string name = std::to_string(i);
    short_lived.at(name, i * kSecond);
    many.at(name, i * kSecond);
    many.at("often", i * kSecond).first += 1;
    EXPECT_LE(short_lived.size(), 12u);
    EXPECT_LE(many.size(), 50u);
  }
  EXPECT_EQ(many.at("often", 5000 * kSecond).first, 5000) << "the one not asked for longest goes";
}

}  // namespace
}  // namespace pocd

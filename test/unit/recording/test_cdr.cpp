#include "pocd/recording/cdr.hpp"

#include <gtest/gtest.h>

#include "pocd/recording/ros_messages.hpp"

namespace pocd::recording {
namespace {

Bytes odometry(bool little_endian) {
  CdrWriter out(little_endian);
  out.number<std::int32_t>(12);
  out.number<std::uint32_t>(34);
  out.string("map");
  out.string("base_link");
  for (const double value : {1.0, -2.0, 3.5, 0.0, 0.0, 0.6, 0.8}) out.number(value);
  for (int i = 0; i < 36 + 6 + 36; ++i) out.number(0.25);
  return out.bytes();
}

TEST(Cdr, BothByteOrdersDecodeAlike) {
  for (const bool little : {true, false}) {
    const Bytes bytes = odometry(little);
    EXPECT_EQ(bytes[1], little ? 1 : 0);
    const RosTransform T = decode_odometry(bytes.data(), bytes.size());
    EXPECT_EQ(T.header.stamp_ns, 12'000'000'034);
    EXPECT_EQ(T.header.frame_id, "map");
    EXPECT_EQ(T.child_frame_id, "base_link");
    EXPECT_EQ(T.T.position.z(), 3.5);
    EXPECT_EQ(T.T.rotation.w(), 0.8);
    EXPECT_EQ(T.T.rotation.z(), 0.6);
  }
}

TEST(Cdr, ShortPayloadsAreDamage) {
  const Bytes bytes = odometry(true);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(decode_odometry(bytes.data(), size), DamagedData) << size;
  }
}

TEST(Cdr, OtherEncapsulationsAreRefusedByNumber) {
  Bytes bytes = odometry(true);
  bytes[1] = 7;
  try {
    decode_odometry(bytes.data(), bytes.size());
    FAIL();
  } catch (const DamagedData& damage) {
    EXPECT_STREQ(damage.what(), "encapsulation 7 is not plain CDR (0, 1)");
  }
}

TEST(Cdr, LengthsThatCannotBeAreDamage) {
  CdrWriter out;
  out.number<std::uint32_t>(0xFFFFFFFFu);
  EXPECT_THROW(decode_tf(out.bytes().data(), out.bytes().size()), DamagedData);
  CdrReader in(out.bytes().data(), out.bytes().size());
  EXPECT_THROW(in.string(), DamagedData);
}

TEST(Cdr, AlignmentCountsFromBehindTheHeader) {
  CdrWriter out;
  out.number<std::uint8_t>(1);
  out.number<double>(2.5);
  EXPECT_EQ(out.bytes().size(), 4u + 16u);
  CdrReader in(out.bytes().data(), out.bytes().size());
  EXPECT_EQ(in.number<std::uint8_t>(), 1);
  EXPECT_EQ(in.number<double>(), 2.5);
  EXPECT_EQ(in.remaining(), 0u);
}

}  // namespace
}  // namespace pocd::recording

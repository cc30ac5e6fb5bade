#include "pocd/map/map_io.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "map_fixtures.hpp"
#include "pocd/common/check.hpp"

namespace pocd::testing {
namespace {

class MapFile : public ::testing::Test {
 protected:
  void SetUp() override {
    config_.voxel_size_m = 0.04;
    ThreadPool pool(1);
    map_ = std::make_unique<TsdfMap>(config_);
    for (const Pose& pose : arc_of_poses(5, 9)) {
      map_->integrate(look({2.5, {{{0, 1.5, 1.0}, 0.3, 70000}}}, pose).input(), pool);
    }
    map_->touch({-1000000, 2000000, -5}).weight[3] = 1000;
    save_map(*map_, file_);
    std::ifstream in(file_, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  void TearDown() override { std::filesystem::remove(file_); }

  void write(const std::string& bytes) {
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << bytes;
  }
  std::string error() {
    try {
      load_map(file_, config_);
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(file_.string()), std::string::npos);
      return e.what();
    }
    return "";
  }

  TsdfConfig config_ = coarse_config();
  std::unique_ptr<TsdfMap> map_;
  std::filesystem::path file_ = std::filesystem::temp_directory_path() / "pocd_test_map_file";
  std::string bytes_;
};

bool says(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

TEST_F(MapFile, ComesBackAsItWas) {
  TsdfMap loaded = load_map(file_, config_);
  EXPECT_TRUE(same_map(*map_, loaded));
  EXPECT_EQ(loaded.take_dirty(), loaded.sorted_keys());
  EXPECT_GT(loaded.clear_object(ObjectId{70000}), 0u);
  // More than one part of 256 blocks.
  EXPECT_GT(map_->block_count(), 256u);
}

TEST_F(MapFile, EqualMapsGiveEqualBytes) {
  save_map(load_map(file_, config_), file_);
  std::ifstream in(file_, std::ios::binary);
  EXPECT_EQ(bytes_,
            std::string(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()));
}

TEST_F(MapFile, EmptyMapIsAFileToo) {
  save_map(TsdfMap(config_), file_);
  EXPECT_EQ(load_map(file_, config_).block_count(), 0u);
}

TEST_F(MapFile, DamageIsNamed) {
  write("");
  EXPECT_PRED2(says, error(), "cut short");
  std::string b = bytes_;
  b[0] = 'X';
  write(b);
  EXPECT_PRED2(says, error(), "no map file");
  b = bytes_;
  b[8] = 9;
  write(b);
  EXPECT_PRED2(says, error(), "version 9");
  b = bytes_;
  b[33] = static_cast<char>(b[33] ^ 1);
  write(b);
  EXPECT_PRED2(says, error(), "header");
  b = bytes_;
  b[bytes_.size() / 2] = static_cast<char>(b[bytes_.size() / 2] ^ 4);
  write(b);
  EXPECT_PRED2(says, error(), "damaged");
  b = bytes_;
  b[51] = 127;
  write(b);
  EXPECT_PRED2(says, error(), "impossible size");
  write(bytes_ + "x");
  EXPECT_PRED2(says, error(), "after the end");
  std::filesystem::remove(file_);
  EXPECT_PRED2(says, error(), "cannot be opened");
}

TEST_F(MapFile, OtherVoxelsAreRefused) {
  config_.voxel_size_m = 0.05;
  EXPECT_PRED2(says, error(), "voxel_size_m 0.04");
}

TEST_F(MapFile, EveryTruncationAndEveryBitFlipIsNoticed) {
  Random random(6);
  for (int i = 0; i < 300; ++i) {
    if (i % 2 == 0) {
      write(bytes_.substr(0, random.below(bytes_.size())));
    } else {
      std::string b = bytes_;
      const std::size_t at = random.below(b.size());
      b[at] = static_cast<char>(b[at] ^ 1 << random.below(8));
      write(b);
    }
    ASSERT_NE(error(), "") << i;
  }
}

TEST_F(MapFile, UnwritableTargetLeavesNothingBehind) {
  const std::filesystem::path folder = file_.string() + ".folder";
  std::filesystem::create_directories(folder / "in the way");
  EXPECT_THROW(save_map(*map_, folder), InputError);
  EXPECT_FALSE(std::filesystem::exists(folder.string() + ".part"));
  std::filesystem::remove_all(folder);
}

TEST_F(MapFile, UnwritableTargetIsNamed) {
  try {
    save_map(*map_, "/nonexistent/folder/map");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_PRED2(says, std::string(e.what()), "/nonexistent/folder/map");
  }
}

}  // namespace
}  // namespace pocd::testing

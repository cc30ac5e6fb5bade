// Layout, little-endian:
//   header, 48 bytes: "POCDMAP\0", u32 version, u32 blocks per part, f64 voxel size [m],
//     f64 truncation [voxels], u64 number of blocks, u64 XXH3 of the 40 bytes before
//   parts: u32 size of the zstd frame, u64 XXH3 of the frame, frame. The frame holds up to `blocks
//     per part` blocks, sorted by region, then by key (TsdfMap::keys_by_region): i32 x, y, z, then
//     the i16 distances, u16 weights and u32 owners of its 512 voxels.
#include "pocd/map/map_io.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <fstream>
#include <optional>

#include "bytes.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/map_reader.hpp"
#include "zstd_codec.hpp"

namespace pocd {
namespace {

constexpr char kMagic[8] = "POCDMAP";
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kHeaderSize = 48, kPartHeaderSize = 12;
constexpr std::size_t kBlocksPerPart = 256;
constexpr std::size_t kBlockSize = 12 + VoxelBlock::kVoxels * (2 + 2 + 4);
constexpr int kLevel = 1;

std::uint64_t checksum(const std::uint8_t* data, std::size_t size) {
  return XXH3_64bits(data, size);
}

std::vector<std::uint8_t> header_of(const TsdfMap& map) {
  std::vector<std::uint8_t> out(kMagic, kMagic + sizeof kMagic);
  put(out, kVersion);
  put(out, static_cast<std::uint32_t>(kBlocksPerPart));
  put_double(out, map.config().voxel_size_m);
  put_double(out, map.config().truncation_voxels);
  put(out, static_cast<std::uint64_t>(map.block_count()));
  put(out, checksum(out.data(), out.size()));
  return out;
}

void put_block(std::vector<std::uint8_t>& out, const VoxelBlock& block) {
  for (const std::int32_t c : {block.key.x, block.key.y, block.key.z}) put(out, c);
  for (const std::int16_t t : block.tsdf) put(out, t);
  for (const std::uint16_t w : block.weight) put(out, w);
  for (const std::uint32_t o : block.owner) put(out, o);
}

BlockKey get_block(const std::uint8_t* in, TsdfMap& map) {
  const BlockKey key{get<std::int32_t>(in), get<std::int32_t>(in + 4), get<std::int32_t>(in + 8)};
  VoxelBlock& block = map.touch(key);
  in += 12;
  for (std::int16_t& t : block.tsdf) t = get<std::int16_t>(in), in += 2;
  for (std::uint16_t& w : block.weight) w = get<std::uint16_t>(in), in += 2;
  for (std::uint32_t& o : block.owner) o = get<std::uint32_t>(in), in += 4;
  return key;
}

bool in_order(const BlockKey& a, const BlockKey& b) {
  return a.region() == b.region() ? a < b : a.region() < b.region();
}

// Reads exactly `size` bytes or rejects the file.
std::vector<std::uint8_t> read(std::ifstream& in, std::size_t size, const std::string& name) {
  std::vector<std::uint8_t> bytes(size);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (static_cast<std::size_t>(in.gcount()) != size) {
    throw InputError(name + ": map file is cut short");
  }
  return bytes;
}

// Number of blocks.
std::uint64_t check_header(const std::vector<std::uint8_t>& header, const TsdfConfig& config,
                           const std::string& name) {
  if (!std::equal(kMagic, kMagic + sizeof kMagic, header.begin())) {
    throw InputError(name + ": is no map file");
  }
  const auto version = get<std::uint32_t>(&header[8]);
  if (version != kVersion) {
    throw InputError(name + ": map file of version " + std::to_string(version) + ", known is " +
                     std::to_string(kVersion));
  }
  if (get<std::uint64_t>(&header[40]) != checksum(header.data(), 40)) {
    throw InputError(name + ": header of the map file is damaged");
  }
  if (get<std::uint32_t>(&header[12]) != kBlocksPerPart) {
    throw InputError(name + ": map file with parts of an unknown size");
  }
  const double voxel_m = get_double(&header[16]), truncation = get_double(&header[24]);
  if (voxel_m != config.voxel_size_m || truncation != config.truncation_voxels) {
    throw InputError(name + ": map file has voxel_size_m " + std::to_string(voxel_m) +
                     ", truncation_voxels " + std::to_string(truncation) + "; configured are " +
                     std::to_string(config.voxel_size_m) + ", " +
                     std::to_string(config.truncation_voxels));
  }
  return get<std::uint64_t>(&header[32]);
}

}  // namespace

void save_map(const TsdfMap& map, const std::filesystem::path& file) {
  std::filesystem::path unfinished = file;
  unfinished += ".part";
  std::ofstream out(unfinished, std::ios::binary);
  const auto write = [&out](const std::vector<std::uint8_t>& bytes) {
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
  };
  const auto discard = [&unfinished] {  // as far as that is possible
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
  };
  try {
    write(header_of(map));
    const std::vector<BlockKey> keys = map.keys_by_region();
    MapReader reader(map);
    for (std::size_t begin = 0; begin < keys.size(); begin += kBlocksPerPart) {
      std::vector<std::uint8_t> raw;
      raw.reserve(kBlocksPerPart * kBlockSize);
      for (std::size_t i = begin; i < std::min(keys.size(), begin + kBlocksPerPart); ++i) {
        put_block(raw, *reader.find(keys[i]));
      }
      const std::vector<std::uint8_t> frame = compress(raw, kLevel);
      std::vector<std::uint8_t> head;
      put(head, static_cast<std::uint32_t>(frame.size()));
      put(head, checksum(frame.data(), frame.size()));
      write(head);
      write(frame);
    }
  } catch (const InputError&) {  // a part of the map is on disk, and unreadable
    out.close();
    discard();
    throw;
  }
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(unfinished, file, error);
  if (out && !error) return;
  discard();
  throw InputError(file.string() + ": map file cannot be written");
}

TsdfMap load_map(const std::filesystem::path& file, const TsdfConfig& config) {
  const std::string name = file.string();
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(name + ": map file cannot be opened");
  std::uint64_t left = check_header(read(in, kHeaderSize, name), config, name);
  TsdfMap map(config);
  std::optional<BlockKey> previous;
  while (left > 0) {
    const std::vector<std::uint8_t> head = read(in, kPartHeaderSize, name);
    const auto size = get<std::uint32_t>(head.data());
    // zstd grows incompressible data by less than one percent.
    if (size > kBlocksPerPart * kBlockSize * 2) {
      throw InputError(name + ": map file has a part of impossible size");
    }
    const std::vector<std::uint8_t> frame = read(in, size, name);
    if (get<std::uint64_t>(&head[4]) != checksum(frame.data(), frame.size())) {
      throw InputError(name + ": a part of the map file is damaged");
    }
    const std::vector<std::uint8_t> raw =
        decompress(frame.data(), frame.size(), kBlocksPerPart * kBlockSize, name);
    const std::size_t blocks = std::min<std::uint64_t>(left, kBlocksPerPart);
    if (raw.size() != blocks * kBlockSize) {
      throw InputError(name + ": a part of the map file has the wrong number of blocks");
    }
    for (std::size_t i = 0; i < blocks; ++i) {
      const BlockKey key = get_block(&raw[i * kBlockSize], map);
      if (previous && !in_order(*previous, key)) {
        throw InputError(name + ": blocks of the map file are out of order");
      }
      previous = key;
    }
    left -= blocks;
  }
  if (in.peek() != std::ifstream::traits_type::eof()) {
    throw InputError(name + ": bytes after the end of the map file");
  }
  return map;
}

}  // namespace pocd

// The files that the test and the peers of other vendors exchange: little-endian, without padding.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "pocd/datasets/open_dataset.hpp"
#include "pocd/input/pose_quaternion.hpp"
#include "pocd/map/map_delta.hpp"

namespace pocd {

/// Writes what a robot would send: u32 width, height; f64 fx, fy, cx, cy; the mount's position and
/// rotation x, y, z, w; then per frame i64 stamp [ns], the base's pose like the mount, u16 labels,
/// f32 depth [m]. Returns the number of frames.
inline int write_frames(DatasetReader& reader, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  const auto put = [&](const auto* data, std::size_t count) {
    out.write(reinterpret_cast<const char*>(data),
              static_cast<std::streamsize>(count * sizeof(*data)));
  };
  const auto put_pose = [&](const Pose& T) {
    const PoseQuaternion pose = to_quaternion(T);
    put(pose.position.data(), 3);
    put(pose.rotation.coeffs().data(), 4);
  };
  const Pose T_B_C = reader.extrinsics().T_B_C;
  int count = 0;
  while (const std::optional<Frame> frame = reader.next()) {
    const CameraModel& camera = frame->camera;
    if (count++ == 0) {
      const std::uint32_t size[2] = {static_cast<std::uint32_t>(camera.width),
                                     static_cast<std::uint32_t>(camera.height)};
      const double focal[4] = {camera.fx, camera.fy, camera.cx, camera.cy};
      put(size, 2);
      put(focal, 4);
      put_pose(T_B_C);
    }
    put(&frame->stamp_ns, 1);
    put_pose(frame->T_W_C * T_B_C.inverse());
    for (int row = 0; row < camera.height; ++row) {
      put(frame->labels.ptr<std::uint16_t>(row), static_cast<std::size_t>(camera.width));
    }
    for (int row = 0; row < camera.height; ++row) {
      put(frame->depth_m.ptr<float>(row), static_cast<std::size_t>(camera.width));
    }
  }
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
  return count;
}

/// What a subscriber heard, in the order in which it took it.
struct PeerLog {
  using Uuid = std::array<std::uint8_t, 16>;
  struct Event {
    std::uint8_t kind;
    std::uint64_t seq;
    Uuid uuid;
    double mu_after;
  };

  std::map<Uuid, std::uint32_t> objects;  ///< present; local ids
  std::vector<Uuid> disposed;
  std::vector<Event> events;
  std::map<TileKey, std::vector<std::uint8_t>> tiles;  ///< of pocd/map/tiles
  std::size_t tiles_disposed = 0;
  std::map<TileKey, std::vector<std::uint8_t>> applied;  ///< of pocd/map/deltas
  std::uint64_t version = 0;
  std::size_t deltas = 0, gaps = 0;
  MapDigest delta_digest, manifest_digest;
  std::uint64_t manifest_version = 0;
  /// Of the topics for ROS 2: the newest list, the numbers of events, the newest health.
  std::uint64_t list_number = 0;
  std::vector<Uuid> listed, removed;
  std::vector<std::uint64_t> ros_events;
  std::uint64_t health_epoch = 0, health_frames = 0;
  bool converged = false;
  /// After "converged", when the component ends.
  std::size_t ended_disposed = 0, ended_without_writers = 0;

  explicit PeerLog(const std::filesystem::path& file) : in_(file, std::ios::binary) {
    for (char kind = 0; in_.get(kind);) record(kind);
  }

  static MapDigest digest(const std::map<TileKey, std::vector<std::uint8_t>>& tiles) {
    MapDigest sum;
    for (const auto& [key, payload] : tiles) {
      const MapDigest one = tile_digest(key, payload);
      sum.low += one.low;
      sum.high += one.high + (sum.low < one.low ? 1 : 0);
    }
    return sum;
  }

 private:
  template <class T>
  T get() {
    T value{};
    if (!in_.read(reinterpret_cast<char*>(&value), sizeof value)) {
      throw std::runtime_error("the peer's log ends within a record");
    }
    return value;
  }
  TileKey key() {
    const auto x = get<std::int32_t>(), y = get<std::int32_t>(), z = get<std::int32_t>();
    return {x, y, z};
  }
  std::vector<std::uint8_t> payload() {
    get<std::uint64_t>();  // the version
    std::vector<std::uint8_t> bytes(get<std::uint32_t>());
    in_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return bytes;
  }

  void record(char kind) {
    if (kind == 'C') {
      converged = true;
    } else if (kind == 'O') {
      const char state = get<char>();
      const auto uuid = get<Uuid>();
      const auto id = get<std::uint32_t>();
      if (converged) {
        ++(state == 'd' ? ended_disposed : ended_without_writers);
      } else if (state == 'p') {
        objects[uuid] = id;
      } else {
        objects.erase(uuid);
        disposed.push_back(uuid);
      }
    } else if (kind == 'E') {
      Event event{};
      event.kind = get<std::uint8_t>();
      event.seq = get<std::uint64_t>();
      event.uuid = get<Uuid>();
      event.mu_after = get<double>();
      events.push_back(event);
    } else if (kind == 'T') {
      const char state = get<char>();
      const TileKey at = key();
      if (state == 'p') {
        tiles[at] = payload();
      } else if (!converged) {
        tiles_disposed += tiles.erase(at);
      }
    } else if (kind == 'D') {
      delta();
    } else if (kind == 'M') {
      manifest_version = get<std::uint64_t>();
      manifest_digest = {get<std::uint64_t>(), 0};
      manifest_digest.high = get<std::uint64_t>();
    } else if (kind == 'L') {
      list_number = get<std::uint64_t>();
      listed.clear(), removed.clear();
      for (auto n = get<std::uint32_t>(); n > 0; --n) listed.push_back(get<Uuid>());
      for (auto n = get<std::uint32_t>(); n > 0; --n) removed.push_back(get<Uuid>());
    } else if (kind == 'R') {
      ros_events.push_back(get<std::uint64_t>());
      get<std::uint8_t>();  // its kind
    } else if (kind == 'H') {
      health_epoch = get<std::uint64_t>();
      health_frames = get<std::uint64_t>();
    } else {
      throw std::runtime_error("the peer's log has an unknown record");
    }
  }

  void delta() {
    const auto base = get<std::uint64_t>();
    const auto next = get<std::uint64_t>();
    if (base != version && next != version) ++gaps;  // parts of one step share both numbers
    version = next;
    ++deltas;
    for (auto n = get<std::uint32_t>(); n > 0; --n) {
      const TileKey at = key();
      applied[at] = payload();
    }
    for (auto n = get<std::uint32_t>(); n > 0; --n) applied.erase(key());
    delta_digest.low = get<std::uint64_t>();
    delta_digest.high = get<std::uint64_t>();
  }

  std::ifstream in_;
};

}  // namespace pocd

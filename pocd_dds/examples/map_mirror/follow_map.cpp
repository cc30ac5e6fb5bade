// Keeps a copy of the published map, says when it is right and when not, and asks it whether a
// place is free.   usage: follow_map DOMAIN X Y Z
#include <pocd_dds/map_mirror.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace {

/// What the map says about a point in the map frame [m].
const char* ask(const pocd::MirrorContents& map, double x_m, double y_m, double z_m) {
  const auto voxel = [&](double m) { return static_cast<int>(std::floor(m / map.voxel_size_m)); };
  const int x = voxel(x_m), y = voxel(y_m), z = voxel(z_m);
  const auto tile = map.tiles.find({x >> 4, y >> 4, z >> 4});
  if (tile == map.tiles.end()) return "not near any surface";
  const pocd::DecodedTile voxels = pocd::decode_tile(tile->second.payload, map.truncation_m);
  const int i = (x & 15) + 16 * ((y & 15) + 16 * (z & 15));
  if (!voxels.observed[i]) return "never seen";
  return voxels.distance_m[i] > 0 ? "free" : "occupied";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: follow_map DOMAIN X Y Z\n");
    return 2;
  }
  pocd::MirrorOptions options;
  options.domain = std::atoi(argv[1]);
  options.on_event = [](const pocd::ObjectEvent& event, const std::string& class_name) {
    std::printf("event %llu: %s at %.2f %.2f\n", static_cast<unsigned long long>(event.sequence),
                class_name.c_str(), event.box.pose.position_W.x(), event.box.pose.position_W.y());
  };
  pocd::MapMirror mirror(options);
  const auto usable = [](const pocd::MirrorStatus& s) { return s.in_step && s.version > 0; };
  if (!mirror.wait_until(usable, std::chrono::seconds(60))) {
    std::printf("no map: %s\n", mirror.status().stale_because.c_str());
    return 1;
  }
  const pocd::MirrorContents map = mirror.contents();
  std::printf("version %llu digest %s: %zu tiles, %zu objects; that place is %s\n",
              static_cast<unsigned long long>(map.status.version), map.status.digest.hex().c_str(),
              map.status.tiles, map.objects.size(),
              ask(map, std::atof(argv[2]), std::atof(argv[3]), std::atof(argv[4])));
  return 0;
}

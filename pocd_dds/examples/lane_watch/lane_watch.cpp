// A fleet manager's view of one lane: says what comes to stand on it, and when it is free again.
// usage: lane_watch DOMAIN WIDTH X1 Y1 X2 Y2 [X3 Y3 ...]   metres of the map frame; ends when
// killed
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <pocd_dds/object_watch.hpp>
#include <set>
#include <vector>

struct Lane {
  double width_m = 0.0;
  std::vector<double> xy;  // x and y of the points that it leads through
  bool has(const pocd::OrientedBox& box) const {
    double nearest = INFINITY;
    for (std::size_t i = 0; i + 3 < xy.size(); i += 2) {
      const double dx = xy[i + 2] - xy[i], dy = xy[i + 3] - xy[i + 1];
      const double px = box.pose.position_W.x() - xy[i], py = box.pose.position_W.y() - xy[i + 1];
      const double along = (px * dx + py * dy) / std::max(dx * dx + dy * dy, 1e-9);
      const double t = std::clamp(along, 0.0, 1.0);
      nearest = std::min(nearest, std::hypot(px - t * dx, py - t * dy));
    }
    return nearest < 0.5 * (width_m + std::hypot(box.size_m.x(), box.size_m.y()));
  }
};

int main(int argc, char** argv) {
  Lane lane;
  for (int i = 2; i < argc; ++i)
    (i == 2 ? lane.width_m : lane.xy.emplace_back()) = std::atof(argv[i]);
  if (lane.xy.size() < 4 || lane.xy.size() % 2 != 0) return 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);

  std::set<std::array<std::uint8_t, 16>> on_lane;
  const auto leaves = [&](const pocd::WatchedObject& object) {
    if (on_lane.erase(object.uuid) == 0) return;
    std::printf("no longer blocked by %u, %zu left\n", to_index(object.state.id), on_lane.size());
  };
  pocd::ObjectWatchOptions options;
  options.domain = std::atoi(argv[1]);
  options.on_object =
      [&](const pocd::WatchedObject& object) {  // new, or changed: it may have moved
        if (!lane.has(object.state.box)) return leaves(object);
        if (!on_lane.insert(object.uuid).second) return;
        std::printf("blocked by %s %u\n", object.class_name.c_str(), to_index(object.state.id));
      };
  options.on_gone = [&](const pocd::WatchedObject& object, pocd::Gone) { leaves(object); };
  options.on_event = [&](const pocd::ObjectEvent& event, const std::string&) {
    if (event.kind == pocd::EventKind::kUpdated || !lane.has(event.box)) return;
    static const char* const kinds[] = {"added", "updated", "moved", "removed"};
    std::printf("%s: %u, because %s\n", kinds[static_cast<int>(event.kind)], to_index(event.object),
                event.evidence.rule.c_str());
  };
  const pocd::ObjectWatch watch(options);
  for (;;) pause();
}

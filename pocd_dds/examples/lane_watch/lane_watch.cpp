// What stands on a lane, what was seen to leave it, and when nobody knows: after a restart of the
// component all is unknown until a robot looks, and without a memory until a person has looked.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <pocd_dds/object_watch.hpp>
#include "lane.hpp"

int main(int argc, char** argv) {
  Lane lane;
  for (int i = 2; i < argc; ++i)
    (i == 2 ? lane.width_m : lane.xy.emplace_back()) = std::atof(argv[i]);
  if (lane.xy.size() < 4 || lane.xy.size() % 2 != 0) {
    std::fputs("usage: lane_watch DOMAIN WIDTH X1 Y1 X2 Y2 [X3 Y3 ...], in metres\n", stderr);
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  // By uuid. Unknown: seen on the lane before the component restarted, and not seen since.
  std::map<std::array<std::uint8_t, 16>, pocd::OrientedBox> on_lane, unknown;
  const auto tell = [&](const char* what, const pocd::WatchedObject& object) {
    for (const auto& [uuid, box] : on_lane) {  // without a memory uuids are new: by its place
      for (auto old = unknown.begin(); old != unknown.end();) {
        const auto way = (old->second.pose.position_W - box.pose.position_W).head<2>().norm();
        old = way < 0.5 * box.size_m.head<2>().minCoeff() ? unknown.erase(old) : std::next(old);
      }
    }
    std::printf("%s %s %u: %zu on the lane, %zu unknown\n", what, object.class_name.c_str(),
                to_index(object.state.id), on_lane.size(), unknown.size());
  };
  pocd::ObjectWatchOptions options;
  options.domain = std::atoi(argv[1]);
  options.on_object = [&](const pocd::WatchedObject& object) {  // new, or changed: may have moved
    auto& to = object.state.seen_in_run ? on_lane : unknown;
    const auto was = (&to == &on_lane ? unknown : on_lane).erase(object.uuid);
    if (!lane.has(object.state.box)) {
      if (was + to.erase(object.uuid) > 0) tell("no longer blocked by", object);
    } else if (to.insert_or_assign(object.uuid, object.state.box).second) {
      tell(&to == &on_lane ? "blocked by" : "unknown since the component restarted:", object);
    }
  };
  options.on_gone = [&](const pocd::WatchedObject& object, pocd::Gone why) {
    if (on_lane.erase(object.uuid) + unknown.erase(object.uuid) == 0) return;
    if (why == pocd::Gone::kRemoved) return tell("no longer blocked by", object);
    unknown[object.uuid] = object.state.box;  // nobody has looked: not free
    tell("unknown since the component restarted:", object);
  };
  options.on_event = [&](const pocd::ObjectEvent& event, const std::string&) {
    if (event.kind == pocd::EventKind::kUpdated || !lane.has(event.box)) return;
    static const char* const kinds[] = {"added", "updated", "moved", "removed"};
    std::printf("%s: %u, because %s\n", kinds[static_cast<int>(event.kind)], to_index(event.object),
                event.evidence.rule.c_str());
  };
  const pocd::ObjectWatch watch(options);
  for (int before = -1, present = 0;; before = present, sleep(1)) {
    present = watch.publisher_present();
    if (present != before) std::puts(present ? "component is there" : "no component: nobody looks");
  }
}

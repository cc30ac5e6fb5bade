#include "view/feed.hpp"

#include <atomic>
#include <cmath>
#include <thread>

#include "pocd_dds/map_mirror.hpp"
#include "pocd_msgsPubSubTypes.h"
#include "view/object_feed.hpp"
#include "view/surface_maker.hpp"

namespace pocd::view {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kTurn{100};
constexpr milliseconds kBeat{1000};      // of a status that says nothing new
constexpr milliseconds kMapPeriod{400};  // a step of the map comes every 0.5 s
constexpr milliseconds kSilence{2500};   // of a node that says every second how it is
constexpr std::size_t kMostNodes = 32;
constexpr std::size_t kTilesAtOnce = 512;
constexpr int kMost = 1000;

dds::BusOptions bus_options(const FeedOptions& options, const std::string& name) {
  dds::BusOptions bus{options.domain, options.profiles_file, name};
  bus.security_folder = options.security_folder;
  return bus;
}

}  // namespace

struct Feed::Impl {
  Impl(const FeedOptions& given, Board& target)
      : options(given),
        board(target),
        objects(board),
        participant(std::make_shared<dds::Participant>(bus_options(options, "pocd_view"))),
        health(participant, dds::topics::kHealth, wakeup),
        events(participant, dds::topics::kObjectEvents, wakeup),
        robots(participant, options.robots, wakeup),
        watch(watch_options()),
        mirror(mirror_options()),
        thread([this] { run(); }),
        map_thread([this] { draw_map(); }) {}
  ~Impl() {
    stopping = true;
    wakeup.wake();
    thread.join();
    map_thread.join();
  }

  ObjectWatchOptions watch_options() {
    ObjectWatchOptions watched;
    watched.domain = options.domain;
    watched.profiles_file = options.profiles_file;
    watched.security_folder = options.security_folder;
    watched.name = "pocd_view_mirror";
    watched.map_id = options.map_id;
    watched.on_object = [this](const WatchedObject& object) { objects.object(object); };
    watched.on_gone = [this](const WatchedObject& o, Gone why) { objects.gone(o, why); };
    return watched;
  }
  MirrorOptions mirror_options() const {
    MirrorOptions mirrored;
    mirrored.domain = options.domain;
    mirrored.profiles_file = options.profiles_file;
    mirrored.security_folder = options.security_folder;
    mirrored.name = "pocd_view_mirror";
    mirrored.map_id = options.map_id;
    return mirrored;
  }

  void run();
  void take_health();
  void take_events();
  void take_robots();
  void say_status();
  void say_health(const std::array<std::uint8_t, 16>& node, const std::string& condition);
  void draw_map();

  const FeedOptions options;
  Board& board;
  ObjectFeed objects;
  dds::Wakeup wakeup;
  std::shared_ptr<dds::Participant> participant;

  // Of the thread.
  dds::Reader<pocd_msgs::msg::NodeHealthPubSubType> health;
  dds::Reader<pocd_msgs::msg::ObjectEventPubSubType> events;
  Robots robots;
  struct Node {
    pocd_msgs::msg::NodeHealth last;
    Clock::time_point heard;
    std::string condition;
  };
  std::map<std::array<std::uint8_t, 16>, Node> nodes;
  dds::ProblemCounter problems;
  std::string said_because;
  bool said_in_step = false;
  Clock::time_point said{};
  std::uint64_t beat = 0;

  // Of the thread of the map; read by the other one.
  std::atomic<double> voxel_m{0.0};
  std::atomic<std::uint64_t> drawn{0}, unreadable{0}, earlier{0};
  std::atomic<bool> drawing{false};

  ObjectWatch watch;
  MapMirror mirror;
  std::atomic<bool> stopping{false};
  std::thread thread, map_thread;
};

void Feed::Impl::run() {
  while (!stopping) {
    wakeup.wait_for(kTurn);
    take_events();
    take_health();
    take_robots();
    say_status();
    std::this_thread::sleep_for(milliseconds(20));  // messages of many robots wake it one by one
  }
}

void Feed::Impl::take_events() {
  events.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (meta.valid && message.map_id() == options.map_id) objects.event(message);
  });
  problems.count_damaged(events);
}

void Feed::Impl::say_health(const std::array<std::uint8_t, 16>& node,
                            const std::string& condition) {
  Node& known = nodes[node];
  known.condition = condition;
  board.put_notice("health/" + hex(node), text_of(health_json(known.last, condition)));
}

void Feed::Impl::take_health() {
  health.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (!meta.valid) return;
    if (nodes.count(message.node()) == 0 && nodes.size() >= kMostNodes) {
      auto oldest = nodes.begin();
      for (auto it = nodes.begin(); it != nodes.end(); ++it) {
        if (it->second.heard < oldest->second.heard) oldest = it;
      }
      board.forget_notice("health/" + hex(oldest->first));
      nodes.erase(oldest);
    }
    Node& node = nodes[message.node()];
    node.last = message;
    node.heard = Clock::now();
    say_health(message.node(), message.message() == "stopped" ? "ended" : "present");
  });
  problems.count_damaged(health);
  for (auto& [key, node] : nodes) {
    if (node.condition == "present" && Clock::now() - node.heard > kSilence) {
      say_health(key, "silent");
    }
  }
}

void Feed::Impl::take_robots() {
  std::set<std::string> names;
  for (const auto& [key, node] : nodes) {
    if (node.condition == "ended") continue;
    for (const auto& robot : node.last.robots()) names.insert(robot.name());
  }
  robots.follow(names);
  for (const auto& [name, json] : robots.take(options.map_frame)) {
    board.put_notice("robot/" + name, text_of(json));
  }
}

void Feed::Impl::say_status() {
  const MirrorStatus status = mirror.status();
  const auto now = Clock::now();
  const bool new_words =
      status.in_step != said_in_step || status.stale_because.empty() != said_because.empty();
  if (!new_words && now - said < kBeat) return;
  said = now;
  said_in_step = status.in_step;
  said_because = status.stale_because;
  std::uint64_t unheard = status.corrupt + problems.total() + robots.problems().total();
  Json json = {{"type", "status"},
               {"beat", ++beat},
               {"in_step", status.in_step},
               {"stale_because", status.stale_because},
               {"run", objects.run_of(status.epoch)},
               {"epoch", hex(status.epoch)},
               {"version", status.version},
               {"tiles", status.tiles},
               {"objects", status.objects},
               {"publisher_present", status.publisher_present},
               {"publisher_seen", status.publisher_seen},
               {"ended", status.final_version},
               {"voxel", voxel_m.load()},
               {"drawing", drawing.load()},
               {"drawn", drawn.load()},
               {"earlier_tiles", earlier.load()},
               {"unknown_objects", objects.unknown()},
               {"unreadable", unheard + unreadable.load()}};
  if (const auto range = objects.time_range()) json["time"] = {range->first, range->second};
  board.put_notice("status", text_of(json));
}

void Feed::Impl::draw_map() {
  SurfaceMaker maker;
  std::uint64_t version = 0, epoch = 0;
  auto looked = Clock::now() - kMapPeriod;
  while (!stopping) {
    if (maker.idle() || Clock::now() - looked > kMapPeriod) {
      const MirrorStatus status = mirror.status();
      // While a copy is still that of the run before, the status is stale.
      const bool usable = status.in_step || status.epoch == epoch;
      if (status.epoch != 0 && usable && (status.version != version || status.epoch != epoch)) {
        MirrorContents contents = mirror.contents();
        if (contents.status.in_step || contents.status.epoch == epoch) {
          version = contents.status.version;
          epoch = contents.status.epoch;
          voxel_m = contents.voxel_size_m;
          maker.update(std::move(contents.tiles), objects.run_of(epoch), contents.truncation_m);
        }
      }
      looked = Clock::now();
    }
    drawing = !maker.idle();
    if (maker.idle()) {
      std::this_thread::sleep_for(milliseconds(50));
      continue;
    }
    board.put_surfaces(maker.make(kTilesAtOnce));
    drawn = maker.drawn();
    unreadable = maker.unreadable();
    earlier = maker.earlier_tiles();
  }
}

Feed::Feed(const FeedOptions& options, Board& board)
    : impl_(std::make_unique<Impl>(options, board)) {}
Feed::~Feed() = default;

std::optional<std::string> Feed::history(const std::string& uuid) const {
  return impl_->objects.history(uuid);
}

std::string Feed::then(double stamp_s) const {
  // Outside of what a stamp can be it is the first or the last one.
  const double bounded = std::min(std::max(stamp_s, -9e9), 9e9);
  return impl_->objects.then(static_cast<StampNs>(std::llround(bounded * 1e9)));
}

std::shared_ptr<dds::Participant> Feed::participant() const { return impl_->participant; }

}  // namespace pocd::view

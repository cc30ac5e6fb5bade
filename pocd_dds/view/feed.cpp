#include "view/feed.hpp"

#include <atomic>
#include <cmath>
#include <random>
#include <thread>

#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_msgsPubSubTypes.h"
#include "view/looks.hpp"
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
constexpr milliseconds kLooksPeriod{5000};  // of what is said of regions that were looked at
constexpr milliseconds kAskAgain{2000};
constexpr std::uint32_t kMostOfReply = 500;

std::array<std::uint8_t, 16> random_id() {
  std::random_device device;
  std::array<std::uint8_t, 16> id{};
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(device());
  return id;
}

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
        manifests(participant, dds::topics::kMapManifest, wakeup),
        log_requests(participant, dds::topics::kEventsRequest),
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
    mirrored.looks = true;
    return mirrored;
  }

  void run();
  void take_health();
  void take_events();
  void take_manifests();
  void take_log();
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
  dds::Reader<pocd_msgs::msg::MapManifestPubSubType> manifests;
  dds::Writer<pocd_msgs::msg::EventsRequestPubSubType> log_requests;
  Robots robots;
  // What the node's log says of before, asked for when it comes.
  const std::array<std::uint8_t, 16> id = random_id();
  std::unique_ptr<dds::Reader<pocd_msgs::msg::EventsReplyPubSubType>> log_replies;  // null: not now
  std::uint64_t log_lineage = 0, log_after = 0;
  bool log_answers = false;  // there is a node that does
  Clock::time_point log_asked{};
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
  std::atomic<std::uint64_t> drawn{0}, unreadable{0}, earlier{0}, not_looked_at{0};
  std::atomic<bool> drawing{false};

  ObjectWatch watch;
  MapMirror mirror;
  std::atomic<bool> stopping{false};
  std::thread thread, map_thread;
};

void Feed::Impl::run() {
  while (!stopping) {
    wakeup.wait_for(kTurn);
    take_manifests();
    take_events();
    take_log();
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

void Feed::Impl::take_manifests() {
  manifests.take_some(kMost, [&](const auto& message, const dds::SampleMeta& meta) {
    if (meta.valid && message.map_id() == options.map_id) {
      objects.know_run(message.epoch(), message.lineage());
    }
  });
  problems.count_damaged(manifests);
}

void Feed::Impl::take_log() {
  const bool answers = log_requests.matched() > 0;
  if (answers && !log_answers) {
    log_replies = std::make_unique<dds::Reader<pocd_msgs::msg::EventsReplyPubSubType>>(
        participant, dds::topics::kEventsReply, wakeup);
    log_asked = {};
  }
  log_answers = answers;
  if (!log_replies) return;
  bool done = !answers, go_on = false;
  log_replies->take_some(kMost, [&](const auto& reply, const dds::SampleMeta& meta) {
    if (!meta.valid || reply.requester() != id || reply.map_id() != options.map_id) return;
    done = done || !reply.problem().empty();
    if (reply.lineage() != log_lineage) {
      // The first answer says how long the log is: as many as are kept are asked for.
      log_lineage = reply.lineage();
      const std::uint64_t before = ObjectFeed::kMostEvents;
      log_after = reply.last_seq() > before ? reply.last_seq() - before : 0;
      go_on = true;
      return;
    }
    if (reply.after_seq() != log_after) return;  // of an older question
    for (const auto& event : reply.events()) {
      objects.logged(event);
      log_after = event.seq();
    }
    done = done || reply.events().empty() || log_after >= reply.last_seq();
    go_on = true;
  });
  problems.count_damaged(*log_replies);
  if (done) {
    log_replies.reset();
    return;
  }
  // A reply may be lost while the two sides find one another.
  if (!go_on && Clock::now() - log_asked < kAskAgain) return;
  pocd_msgs::msg::EventsRequest request;
  request.requester(id);
  request.map_id(options.map_id);
  request.after_seq(log_after);
  request.most(kMostOfReply);
  log_requests.write(request);
  log_asked = Clock::now();
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
  for (const RobotPose& pose : robots.take(options.map_frame)) objects.robot(pose);
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
  std::uint64_t unheard = status.corrupt + problems.total() + robots.problems();
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
               {"regions_not_looked_at", not_looked_at.load()},
               {"unknown_objects", objects.unknown()},
               {"unreadable", unheard + unreadable.load()}};
  if (const auto range = objects.time_range()) json["time"] = {range->first, range->second};
  if (const auto since = board.map_known_since()) json["map_since"] = seconds(*since);
  board.put_notice("status", text_of(json));
}

void Feed::Impl::draw_map() {
  SurfaceMaker maker;
  Looks looks(board);
  std::uint64_t version = 0, epoch = 0;
  StampNs stamp_ns = 0;  // of the map that is drawn
  auto looked = Clock::now() - kMapPeriod, told_looks = looked;
  while (!stopping) {
    if (maker.idle() || Clock::now() - looked > kMapPeriod) {
      const MirrorStatus status = mirror.status();
      // While a copy is still that of the run before, the status is stale.
      const bool usable = status.in_step || status.epoch == epoch;
      const bool is_new = status.version != version || status.epoch != epoch;
      const bool looks_due = Clock::now() - told_looks > kLooksPeriod;
      const std::uint32_t run = objects.run_of(status.epoch);
      if (run != 0 && usable && (is_new || looks_due)) {
        MirrorContents contents = mirror.contents();
        if (contents.status.epoch == status.epoch &&
            (contents.status.in_step || contents.status.epoch == epoch)) {
          version = contents.status.version;
          epoch = contents.status.epoch;
          voxel_m = contents.voxel_size_m;
          not_looked_at = looks.tell(contents.regions);
          told_looks = Clock::now();
          // Those of objects and cameras are the newest that were heard; a map has none of its own.
          if (const auto range = objects.time_range()) stamp_ns = stamp_from(range->second);
          if (is_new) {
            maker.update(std::move(contents.tiles), run, contents.voxel_size_m,
                         contents.truncation_m);
          }
        }
      }
      looked = Clock::now();
    }
    drawing = !maker.idle();
    if (maker.idle()) {
      if (epoch != 0 && stamp_ns != 0) board.map_known_from(stamp_ns);
      std::this_thread::sleep_for(milliseconds(50));
      continue;
    }
    board.put_surfaces(maker.make(kTilesAtOnce), stamp_ns);
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
  const StampNs stamp_ns = stamp_from(stamp_s);
  const auto since = impl_->board.map_known_since();
  return impl_->objects.then(stamp_ns, since && stamp_ns >= *since);
}

std::shared_ptr<dds::Participant> Feed::participant() const { return impl_->participant; }

}  // namespace pocd::view

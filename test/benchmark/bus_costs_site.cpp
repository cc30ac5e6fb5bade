#include "bus_costs_site.hpp"

#include <cmath>
#include <set>
#include <thread>

#include "pocd_dds/node/intake.hpp"

namespace pocd::benchmark {
namespace {

constexpr std::uint64_t kEpoch = 1;
constexpr double kSpeed_mps = 1.2, kFrameRate_hz = 15.0;
constexpr std::chrono::milliseconds kTurn{5};
constexpr std::chrono::milliseconds kTick{33};
constexpr int kMostTicksLate = 4;  // a node drops frames that wait for longer

double seconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double>(time).count();
}
StampNs wall_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void touch_all(TsdfMap& map) {
  for (const BlockKey& key : map.sorted_keys()) map.touch(key);
}

}  // namespace

DriveLoad drive_load(Site& site, double map_period_s, double object_period_s) {
  const std::vector<Frame> drive = drive_through_hall(kSpeed_mps / kFrameRate_hz, 7);
  const auto frames_per_step = static_cast<std::size_t>(map_period_s * kFrameRate_hz);
  const auto frames_per_round =
      static_cast<std::size_t>(std::ceil(object_period_s * kFrameRate_hz));
  DriveLoad load;
  load.seconds = static_cast<double>(drive.size()) / kFrameRate_hz;
  TsdfMap& map = site.pipeline().map();
  MapPublisher publisher(kEpoch, scale_config().map);
  touch_all(map);
  publisher.update(map);
  std::set<ObjectId> changed;
  double states = 0.0, events = 0.0, tiles = 0.0, bytes = 0.0;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const FrameResult result = site.process(drive[i]);
    events += static_cast<double>(result.events.size());
    for (const ObjectSnapshot& object : result.changed_objects) changed.insert(object.id);
    if (i % frames_per_round == 0) states += static_cast<double>(changed.size()), changed.clear();
    if ((i + 1) % frames_per_step != 0) continue;
    // Looked at before the publisher takes them.
    auto& step = load.steps.emplace_back();
    for (const BlockKey& key : map.take_dirty()) {
      const VoxelBlock* block = map.find(key);
      if (block == nullptr) continue;  // has become empty
      step.emplace_back(key, *block);
      map.touch(key);
    }
    const auto delta = publisher.update(map);
    if (!delta) continue;
    tiles += static_cast<double>(delta->changed.size());
    for (const MapTile& tile : delta->changed) bytes += static_cast<double>(tile.payload.size());
  }
  load.tiles_per_step = tiles / static_cast<double>(load.steps.size());
  load.tile_bytes_per_s = bytes / load.seconds;
  load.states_per_s = states / load.seconds;
  load.events_per_s = events / load.seconds;
  return load;
}

SitePublisher::SitePublisher(Site& site, const NodeFile& config, const dds::BusOptions& bus)
    : site_(site),
      config_(config),
      participant_(std::make_shared<dds::Participant>(bus)),
      objects_(participant_, config_, kEpoch),
      map_(participant_, config_, kEpoch, wakeup_),
      status_(participant_, "costs", kEpoch, RosOutputConfig{}),
      outputs_(participant_, config_, kEpoch),
      snapshots_(site.pipeline().objects()) {}

void SitePublisher::publish_all() {
  touch_all(site_.pipeline().map());
  map_.begin_step(true);
  map_.send_step(map_.make_step(site_.pipeline().map()), 1);
  FrameResult all;
  all.changed_objects = snapshots_;
  objects_.add(all, wall_ns());
  objects_.send_due(true);
}

void SitePublisher::write_objects(const DriveLoad& load, int robots, double seconds,
                                  StampNs stamp_ns) {
  FrameResult result;
  for (states_due_ += load.states_per_s * robots * seconds; states_due_ >= 1.0; --states_due_) {
    // What a robot looks at for some seconds.
    const auto robot = random_.below(static_cast<std::uint64_t>(robots));
    const auto seen =
        robot * snapshots_.size() / static_cast<std::size_t>(robots) + random_.below(3);
    result.changed_objects.push_back(snapshots_[seen % snapshots_.size()]);
  }
  for (events_due_ += load.events_per_s * robots * seconds; events_due_ >= 1.0; --events_due_) {
    const ObjectSnapshot& object = snapshots_[random_.below(snapshots_.size())];
    ObjectEvent event;
    event.sequence = ++events_;
    event.kind = EventKind::kUpdated;
    event.object = object.id;
    event.class_id = object.class_id;
    event.stamp_ns = stamp_ns;
    event.robot = object.last_robot;
    event.box = object.box;
    event.previous_box = object.box;
    event.evidence.rule = "geometric_change";
    result.events.push_back(event);
  }
  objects_.add(result, stamp_ns);
  tellers_wakeup_.wake();
}

void SitePublisher::change_map(const DriveLoad& load, int robots) {
  TsdfMap& map = site_.pipeline().map();
  const double block_m = config_.pipeline.map.voxel_size_m * VoxelBlock::kSide;
  for (int robot = 0; robot < robots; ++robot) {
    const Eigen::Vector2d place = site_.place_m(robot % site_.halls());
    const auto dx = static_cast<std::int32_t>(std::lround(place.x() / block_m));
    const auto dy = static_cast<std::int32_t>(std::lround(place.y() / block_m));
    // Robots are at different points of their way.
    const auto offset = static_cast<std::size_t>(robot) * load.steps.size() / 100;
    for (const auto& [key, block] : load.steps[(step_ + offset) % load.steps.size()]) {
      map.touch({key.x + dx, key.y + dy, key.z}) = block;
    }
  }
  ++step_;
}

void SitePublisher::send_status(int robots) {
  dds::IntakeStatus input;
  for (int i = 0; i < robots; ++i) {
    dds::RobotStatus robot;
    robot.name = "robot" + std::to_string(i);
    robot.live = true;
    robot.frames = step_;
    input.robots.push_back(robot);
  }
  dds::WorkStatus work;
  work.map = map_.traffic();
  work.objects = objects_.count();
  map_.send_manifest(work.objects, false);
  status_.send({input, work, 0, 0, dds::NodeState{}, false}, wall_ns());
}

void SitePublisher::work(const std::atomic<bool>& stopping, const DriveLoad& load, int robots) {
  auto tick = Clock::now(), ticked = tick;
  change_map(load, robots);
  while (!stopping) {
    // Frames come when they come: all that holds one up here counts as its delay.
    tick = std::max(tick + kTick, Clock::now() - kMostTicksLate * kTick);
    std::this_thread::sleep_until(tick);
    const StampNs stamp_ns = wall_ns() - std::chrono::nanoseconds(Clock::now() - tick).count();
    write_objects(load, robots, seconds(tick - ticked), stamp_ns);
    ticked = tick;
    if (!map_.begin_step(false)) continue;
    map_.send_step(map_.make_step(site_.pipeline().map()), stamp_ns);
    change_map(load, robots);
  }
}

void SitePublisher::tell(const std::atomic<bool>& stopping) {
  while (!stopping) {
    tellers_wakeup_.wait_for(kTick);
    objects_.send_due(false);
  }
}

void SitePublisher::draw(const std::atomic<bool>& stopping) {
  while (!stopping) {
    std::this_thread::sleep_for(kTick);
    const StampNs now_ns = wall_ns();
    {
      const auto held = map_.hold();
      const auto held_objects = objects_.hold();
      outputs_.collect({objects_.objects(), objects_.touched()},
                       {map_.publisher().tiles(), map_.changed()}, now_ns, now_ns, false);
    }
    outputs_.send();
  }
}

void SitePublisher::serve(const std::function<bool()>& done, const DriveLoad& load, int robots) {
  std::atomic<bool> stopping{false};
  std::thread worker, teller([&] { tell(stopping); }), drawer([&] { draw(stopping); });
  if (robots > 0) worker = std::thread([&] { work(stopping, load, robots); });
  auto told = Clock::time_point{};
  while (!done()) {
    wakeup_.wait_for(kTurn);
    map_.answer_requests();
    map_.send_waiting();
    if (seconds(Clock::now() - told) >= 1.0) told = Clock::now(), send_status(robots);
  }
  stopping = true;
  drawer.join();
  teller.join();
  if (worker.joinable()) worker.join();
}

}  // namespace pocd::benchmark

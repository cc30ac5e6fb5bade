#include "pocd_dds/node/node.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

#include "pocd/common/check.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd_dds/node/event_feed.hpp"
#include "pocd_dds/node/frame_log.hpp"
#include "pocd_dds/node/latency_log.hpp"
#include "pocd_dds/node/map_publication.hpp"
#include "pocd_dds/node/node_memory.hpp"
#include "pocd_dds/node/object_publication.hpp"
#include "pocd_dds/node/rival_watch.hpp"
#include "pocd_dds/node/ros_outputs.hpp"

namespace pocd::dds {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPoll{50};
constexpr std::chrono::milliseconds kMapTurn{5};  // while map data waits for its rate
constexpr double kStatusPeriodS = 1.0;

double seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

BusOptions watched(BusOptions bus, BusWatch& watch) {
  bus.listener = &watch;
  return bus;
}

}  // namespace

struct Node::Impl {
  explicit Impl(const NodeOptions& options)
      : config(options.config),
        participant(std::make_shared<Participant>(watched(options.bus, watch))),
        pipeline(config.pipeline),
        keeper(config),
        latency(options.latency_file),
        queue(static_cast<std::size_t>(config.node.queue_frames)),
        outputs(participant, config, options.epoch),
        clock(participant, config.node.use_clock, outputs_wakeup),
        rivals(participant, {static_cast<std::uint32_t>(config.node.map_id), options.epoch},
               wakeup),
        frames(participant, options.epoch),
        objects(participant, config, options.epoch, keeper.lineage(options.epoch)),
        map(participant, config, options.epoch, wakeup, keeper.lineage(options.epoch)),
        feed(keeper.on() ? std::make_unique<EventFeed>(participant, config, wakeup) : nullptr),
        status(participant, options.bus.name, options.epoch, config.node.outputs.diagnostics_hz),
        restored((keeper.restore(pipeline, map, objects, options.epoch, options.bus.name), true)),
        intake(participant, config.node, config.pipeline.classes, watch, queue, latency),
        worker([this] { guard([this] { work(); }); }),
        drawer([this] { guard([this] { draw(); }); }) {}

  ~Impl() {
    intake.stop();
    if (worker.joinable()) worker.join();
    stop_drawing();
  }

  /// What a thread ends with is what run() throws.
  void guard(const std::function<void()>& task);
  void work();
  void draw();
  void stop_drawing();
  void process(const Frame& frame);
  void publish(bool now);
  /// What is wrong on the bus beside the robots' topics.
  void add_problems(IntakeStatus& input);
  void send_status(const std::string& state);
  void send_outputs(bool last);
  void turn();
  bool finish();

  const NodeFile config;
  BusWatch watch;  // outlives the participant
  const std::shared_ptr<Participant> participant;
  PocdPipeline pipeline;  // worker only
  NodeMemory keeper;      // worker only, but for its status
  LatencyLog latency;
  FrameQueue queue;
  Wakeup wakeup;

  // The drawing thread only, until it has ended; but for what is thread-safe.
  Wakeup outputs_wakeup;
  RosOutputs outputs;
  NodeClock clock;  // thread-safe
  std::atomic<bool> drawn{false};

  // run()'s thread only.
  RivalWatch rivals;
  ProblemCounter problems;
  Clock::time_point status_sent{};
  bool map_waits = false;

  // Guards everything below that several threads use; the map has a lock of its own, because only
  // its data is so large that encoding and writing it would hold up the others.
  mutable std::mutex mutex;
  FrameLog frames;
  ObjectPublication objects;
  MapPublication map;
  std::unique_ptr<EventFeed> feed;  // run()'s thread only; null without a memory
  StatusPublication status;
  WorkStatus counts;
  double busy_ms = 0.0;
  std::uint64_t busy_frames = 0;
  std::exception_ptr failure;
  std::atomic<bool> failed{false}, worked{false};
  const bool restored;  // before frames come

  Intake intake;
  std::thread worker, drawer;
};

void Node::Impl::guard(const std::function<void()>& task) {
  try {
    task();
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex);
    failure = std::current_exception();
    failed = true;
  }
}

void Node::Impl::work() {
  while (!queue.finished()) {
    const std::optional<Frame> frame = queue.pop(kPoll);
    if (frame) {
      intake.room_made();
      process(*frame);
    }
    publish(false);
  }
  publish(true);
  keeper.finish(pipeline, map.publisher(), counts.stamp_ns);
  worked = true;
  wakeup.wake();
}

void Node::Impl::draw() {
  while (!drawn) {
    outputs_wakeup.wait_for(kPoll);
    send_outputs(false);
  }
}

void Node::Impl::stop_drawing() {
  drawn = true;
  outputs_wakeup.wake();
  if (drawer.joinable()) drawer.join();
}

void Node::Impl::process(const Frame& frame) {
  const auto start = Clock::now();
  latency.started(frame.robot, frame.stamp_ns);
  FrameResult result;
  try {
    result = pipeline.process_frame(frame);
  } catch (const InputError& error) {
    result.accepted = false;
    result.warnings.push_back(error.what());
  }
  latency.processed(frame.robot, frame.stamp_ns);
  const std::lock_guard<std::mutex> lock(mutex);
  for (const StageTiming& stage : result.timings) counts.pipeline_cpu_ms += stage.cpu_ms;
  busy_ms += 1e3 * seconds(Clock::now() - start);
  ++busy_frames;
  ++counts.processed;
  if (!result.accepted) ++counts.refused;
  counts.stamp_ns = frame.stamp_ns;
  for (const std::string& warning : result.warnings) {
    counts.last_warning = frame.robot + " frame " + std::to_string(frame.sequence) + ": " + warning;
    if (counts.warnings++ == 0) spdlog::warn("{} (more in diagnostics)", counts.last_warning);
  }
  frames.processed(frame);
  for (const DroppedFrame& dropped : queue.take_dropped()) frames.dropped(dropped);
  objects.add(result, frame.stamp_ns);
  keeper.add(result);
  counts.memory = pipeline.map().memory_status();
}

void Node::Impl::publish(bool now) {
  const double cpu_ms = thread_cpu_ms();
  {
    const std::lock_guard<std::mutex> lock(mutex);
    objects.send_due(now);
  }
  // Compressed while the others go on; only this thread changes what it reads.
  const bool step = map.begin_step(now || keeper.overdue());
  std::optional<MapDelta> delta;
  if (step) delta = map.make_step(pipeline.map());
  std::unique_lock<std::mutex> lock(mutex);
  if (step) {
    map.send_step(std::move(delta), counts.stamp_ns);
    latency.in_step();
  }
  if (map.deltas_written()) latency.written();
  counts.publishing_cpu_ms += thread_cpu_ms() - cpu_ms;
  const StampNs stamp_ns = counts.stamp_ns;
  lock.unlock();
  if (step) keeper.step(pipeline, map.publisher(), stamp_ns);
}

void Node::Impl::add_problems(IntakeStatus& input) {
  for (const std::uint64_t epoch : rivals.take()) {
    spdlog::warn(
        "{}: epoch {:016x} publishes map {} as well: subscribers follow one of the two and say "
        "that "
        "they are stale; give each node a node.map_id of its own",
        topics::kMapManifest.name, epoch, config.node.map_id);
  }
  if (rivals.manifests_heard() > 0) {
    input.problems.push_back(
        {topics::kMapManifest.name, "second_publisher", rivals.manifests_heard(), ""});
  }
  if (outputs.grid_too_large()) {
    input.problems.push_back({topics::kOccupancy.name, "grid_too_large", 1, ""});
  }
  rivals.count_problems(problems);
  map.count_problems(problems);
  clock.count_problems(problems);
  keeper.count_problems(problems);
  if (feed) feed->count_problems(problems);
  const auto more = problems.entries();
  input.problems.insert(input.problems.end(), more.begin(), more.end());
}

void Node::Impl::send_status(const std::string& state) {
  IntakeStatus input = intake.status();
  add_problems(input);
  const std::lock_guard<std::mutex> lock(mutex);
  counts.processing_ms = busy_frames == 0 ? 0.0 : busy_ms / static_cast<double>(busy_frames);
  busy_ms = 0.0;
  busy_frames = 0;
  counts.latency_ms = latency.take_longest_ms();
  counts.intake_cpu_ms = input.cpu_ms;
  counts.take_cpu_ms = input.take_cpu_ms;
  counts.process_cpu_ms = process_cpu_ms();
  counts.write_failures =
      objects.failures() + map.failures() + frames.failures() + outputs.failures() +
      (feed ? feed->failures() : 0);
  counts.map = map.traffic();
  counts.objects = objects.objects().size();
  map.send_manifest(counts.objects, state == "stopped" && map.waiting() == 0,
                    keeper.status());
  counts.kept = keeper.on() ? std::make_optional(keeper.status()) : std::nullopt;
  status.send(input, counts, queue.size(), queue.dropped(), state, clock.now_ns());
}

void Node::Impl::send_outputs(bool last) {
  const StampNs now_ns = clock.now_ns();
  {
    const std::lock_guard<std::mutex> lock(mutex);
    const auto held = map.hold();
    outputs.collect({objects.objects(), objects.touched()},
                    {map.publisher().tiles(), map.changed()}, counts.stamp_ns, now_ns, last);
  }
  outputs.send();
}

void Node::Impl::turn() {
  wakeup.wait_for(map_waits ? kMapTurn : kPoll);
  const double cpu_ms = thread_cpu_ms();
  map.answer_requests();
  map.send_waiting();
  if (feed) feed->answer();
  {
    const std::lock_guard<std::mutex> lock(mutex);
    if (map.deltas_written()) latency.written();
    counts.publishing_cpu_ms += thread_cpu_ms() - cpu_ms;
  }
  map_waits = map.waiting() > 0;
  const auto now = Clock::now();
  if (seconds(now - status_sent) >= kStatusPeriodS) {
    status_sent = now;
    send_status("running");
  }
}

bool Node::Impl::finish() {
  intake.stop();
  // What is queued may take seconds: subscribers go on to hear of it, and that the node is there.
  while (!worked && !failed) turn();
  worker.join();
  stop_drawing();
  if (failure) std::rethrow_exception(failure);
  intake.rethrow();
  const auto wait =
      std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * config.node.shutdown_wait_s));
  // The manifest that says that this was all follows the last delta.
  const auto end = Clock::now() + wait;
  while (map.waiting() > 0 && Clock::now() < end) turn();
  if (map.waiting() > 0) {
    spdlog::error("{} messages of the map were not sent within node.shutdown_wait_s",
                  map.waiting());
  }
  send_status("stopped");
  send_outputs(true);
  const std::lock_guard<std::mutex> lock(mutex);
  // A late subscriber that asked for a snapshot just now still gets it.
  const bool acknowledged = map.waiting() == 0 && objects.wait_acknowledged(end) &&
                            map.wait_acknowledged(end) && frames.wait_acknowledged(end) &&
                            status.wait_acknowledged(end) && outputs.wait_acknowledged(end);
  if (!acknowledged) spdlog::error("subscribers did not acknowledge the last state in time");
  return acknowledged && counts.write_failures == 0;
}

Node::Node(const NodeOptions& options) {
  POCD_CHECK(options.epoch != 0);
  impl_ = std::make_unique<Impl>(options);
}

Node::~Node() = default;

bool Node::run(const std::atomic<bool>& stop) {
  Impl& node = *impl_;
  while (!stop && !node.failed && !node.intake.failed()) node.turn();
  return node.finish();
}

WorkStatus Node::work_status() const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  return impl_->counts;
}

}  // namespace pocd::dds

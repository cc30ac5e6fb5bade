#include "pocd_dds/node/node.hpp"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"
#include "pocd_dds/node/node_impl.hpp"

namespace pocd::dds {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPoll{50};
constexpr std::chrono::milliseconds kMapTurn{5};  // while map data waits for its rate
constexpr double kStatusPeriodS = 1.0;

double seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

BusOptions watched(BusOptions bus, const NodeConfig& node, BusWatch& watch) {
  bus.listener = &watch;
  bus.user_data = RosGraph::user_data(node.outputs);
  bus.stall_s = node.stall_s;
  return bus;
}

}  // namespace

Node::Impl::Impl(const NodeOptions& options)
    : config(options.config),
      on_status(options.on_status),
      participant(std::make_shared<Participant>(watched(options.bus, config.node, watch))),
      pipeline(config.pipeline),
      keeper(config),
      latency(options.latency_file),
      queue(static_cast<std::size_t>(config.node.queue_frames)),
      outputs(participant, config, options.epoch),
      clock(participant, config.node.use_clock, outputs_wakeup),
      rivals(participant, {static_cast<std::uint32_t>(config.node.map_id), options.epoch}, wakeup),
      frames(participant, options.epoch),
      objects(participant, config, options.epoch, keeper.lineage(options.epoch)),
      map(participant, config, options.epoch, wakeup, keeper.lineage(options.epoch)),
      health(config.node.health_window_s, config.node.stall_s) {
  const MapRun run{static_cast<std::uint32_t>(config.node.map_id), options.epoch,
                   keeper.lineage(options.epoch)};
  if (config.node.commands) desk = std::make_unique<CommandDesk>(participant, run, wakeup);
  if (keeper.on()) {
    feed = std::make_unique<EventFeed>(participant, config, wakeup);
    looks = std::make_unique<LookPublication>(participant, run);
    keeper.restore(pipeline, map, objects, *looks, options.epoch, options.bus.name);
  }
  // What says that the node is there, and what brings frames, comes after all that is known.
  status = std::make_unique<StatusPublication>(participant, options.bus.name, options.epoch,
                                               config.node.outputs);
  graph = std::make_unique<RosGraph>(participant, config.node.outputs);
  intake =
      std::make_unique<Intake>(participant, config.node, config.pipeline, watch, queue, latency);
  worker = std::thread([this] { guard("pocd_worker", [this] { work(); }); });
  teller = std::thread([this] { guard("pocd_teller", [this] { tell(); }); });
  drawer = std::thread([this] { guard("pocd_drawer", [this] { draw(); }); });
}

Node::Impl::~Impl() {
  intake->stop();
  if (worker.joinable()) worker.join();
  stop(told, tellers_wakeup, teller);
  stop(drawn, outputs_wakeup, drawer);
}

void Node::Impl::guard(const char* name, const std::function<void()>& task) {
  pthread_setname_np(pthread_self(), name);
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
      intake->room_made();
      process(*frame);
    }
    publish(follow_words());
    worker_pulse.beat();
  }
  publish(true);
  keeper.finish(pipeline, map.publisher(), counts.stamp_ns);
  worked = true;
  wakeup.wake();
}

// Writing takes time for every subscriber: neither the pipeline nor the map waits for it.
void Node::Impl::tell() {
  while (!told) {
    tellers_wakeup.wait_for(kPoll);
    objects.send_due(false);
    frames.send();
    teller_pulse.beat();
  }
  objects.send_due(true);
  frames.send();
}

// Nobody's work depends on these topics, so nothing that goes wrong with them ends the node.
void Node::Impl::draw() {
  while (!drawn) {
    outputs_wakeup.wait_for(kPoll);
    try {
      send_outputs(false);
    } catch (const std::exception& error) {
      if (draws_failed++ == 0) spdlog::error("topics for others: {}", error.what());
    }
  }
}

void Node::Impl::stop(std::atomic<bool>& over, Wakeup& wakeup, std::thread& thread) {
  over = true;
  wakeup.wake();
  if (thread.joinable()) thread.join();
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
  if (looks) {
    const std::vector<RegionLook> fresh = pipeline.take_looks();
    map.looked_at(fresh);
    looks->looked_at(fresh);
  }
  frames.processed(frame);
  for (const DroppedFrame& dropped : queue.take_dropped()) frames.dropped(dropped);
  objects.add(result, frame.stamp_ns);
  keeper.add(result);
  counts.memory = pipeline.map().memory_status();
  tellers_wakeup.wake();
}

bool Node::Impl::follow_words() {
  bool followed = false;
  while (desk) {
    const std::optional<OperatorWord> word = desk->next();
    if (!word) break;
    const WordOutcome outcome = pipeline.apply(*word);
    if (outcome.done) {
      spdlog::info("{} by {}: {}", to_string(word->kind), word->by, outcome.text);
      const std::lock_guard<std::mutex> lock(mutex);
      objects.add(outcome.result, outcome.result.events.back().stamp_ns);
      keeper.add(outcome.result);
      keeper.hurry();
      counts.memory = pipeline.map().memory_status();
      tellers_wakeup.wake();
      followed = true;
    }
    desk->done(outcome);
  }
  return followed;
}

void Node::Impl::publish(bool now) {
  const double cpu_ms = thread_cpu_ms();
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

void Node::Impl::send_outputs(bool last) {
  const StampNs now_ns = clock.now_ns();
  {
    const std::lock_guard<std::mutex> lock(mutex);
    const auto held = map.hold();
    const auto held_objects = objects.hold();
    outputs.collect({objects.objects(), objects.touched()},
                    {map.publisher().tiles(), map.changed()}, counts.stamp_ns, now_ns, last,
                    map.not_looked());
  }
  outputs.send();
}

void Node::Impl::answer_words() {
  if (!desk) return;
  desk->take();
  desk->answer(keeper.on() ? std::make_optional(keeper.status()) : std::nullopt);
}

void Node::Impl::turn() {
  wakeup.wait_for(map_waits ? kMapTurn : kPoll);
  const double cpu_ms = thread_cpu_ms();
  map.answer_requests();
  map.send_waiting();
  if (feed) feed->answer();
  if (looks) looks->send_due();
  answer_words();
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
  ending = true;
  intake->stop();
  // What is queued may take seconds: subscribers go on to hear of it, and that the node is there.
  while (!worked && !failed) turn();
  worker.join();
  answer_words();
  stop(told, tellers_wakeup, teller);
  stop(drawn, outputs_wakeup, drawer);
  if (failure) std::rethrow_exception(failure);
  intake->rethrow();
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
  try {
    send_outputs(true);
  } catch (const std::exception& error) {
    spdlog::error("topics for others: {}", error.what());
  }
  const std::lock_guard<std::mutex> lock(mutex);
  // A late subscriber that asked for a snapshot just now still gets it.
  const bool acknowledged = map.waiting() == 0 && objects.wait_acknowledged(end) &&
                            map.wait_acknowledged(end) && frames.wait_acknowledged(end) &&
                            status->wait_acknowledged(end) && outputs.wait_acknowledged(end) &&
                            (!looks || looks->finish(end));
  if (!acknowledged) spdlog::error("subscribers did not acknowledge the last state in time");
  return acknowledged && !failing;
}

Node::Node(const NodeOptions& options) {
  POCD_CHECK(options.epoch != 0);
  impl_ = std::make_unique<Impl>(options);
}

Node::~Node() = default;

bool Node::run(const std::atomic<bool>& stop) {
  Impl& node = *impl_;
  while (!stop && !node.failed && !node.intake->failed()) node.turn();
  return node.finish();
}

WorkStatus Node::work_status() const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  return impl_->counts;
}

}  // namespace pocd::dds

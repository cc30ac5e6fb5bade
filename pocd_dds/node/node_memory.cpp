#include "pocd_dds/node/node_memory.hpp"

#include <spdlog/spdlog.h>

#include <chrono>

namespace pocd::dds {
namespace {

StampNs wall_clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

NodeMemory::NodeMemory(const NodeFile& config) : config_(config) {
  if (config.node.memory.on()) memory_.emplace(config.node.memory, config.pipeline.map);
}

std::uint64_t NodeMemory::lineage(std::uint64_t epoch) const {
  return memory_ ? memory_->lineage() : epoch;
}

void NodeMemory::restore(PocdPipeline& pipeline, MapPublication& map, ObjectPublication& objects,
                         LookPublication& looks, std::uint64_t epoch, const std::string& name) {
  const auto start = std::chrono::steady_clock::now();
  memory_->restore(pipeline, map.publisher_to_restore());
  if (memory_->holds_something()) {
    // Frames that the last run has seen and not kept are not seen again.
    if (!memory_->ended_clean()) pipeline.skip_to(memory_->reserved());
    const std::vector<ObjectSnapshot> known = pipeline.objects();
    map.restored(memory_->stamp_ns());
    objects.restore(known, memory_->stamp_ns());
    looks.restored(pipeline.looks());
    spdlog::info("memory {}: lineage {:016x}, {} objects, {} tiles, map version {}, in {:.2f} s{}",
                 config_.node.memory.folder, memory_->lineage(), known.size(),
                 map.publisher().tiles().size(), map.publisher().version(),
                 std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
                 memory_->ended_clean() ? "" : "; the last run did not end in order");
  }
  memory_->start(pipeline, config_.pipeline.classes, {epoch, name, wall_clock_ns()});
}

void NodeMemory::add(const FrameResult& result) {
  if (!memory_) return;
  changed_ = true;
  memory_->add(result);
}

bool NodeMemory::overdue() const {
  if (!memory_) return false;
  return hurried_ ? memory_->free() : changed_ && memory_->due();
}

void NodeMemory::step(PocdPipeline& pipeline, const MapPublisher& publisher, StampNs stamp_ns) {
  if (!overdue()) return;
  changed_ = hurried_ = false;
  memory_->step(pipeline, publisher, stamp_ns != 0 ? stamp_ns : memory_->stamp_ns());
}

void NodeMemory::finish(PocdPipeline& pipeline, const MapPublisher& publisher, StampNs stamp_ns) {
  if (!memory_) return;
  const StampNs last_ns = stamp_ns != 0 ? stamp_ns : memory_->stamp_ns();
  if (!memory_->finish(pipeline, publisher, last_ns)) {
    spdlog::error("memory {}: the last state could not be kept: {}", config_.node.memory.folder,
                  memory_->status().problem);
  }
}

MemoryStatus NodeMemory::status() const { return memory_ ? memory_->status() : MemoryStatus{}; }

void NodeMemory::count_problems(ProblemCounter& problems) {
  const MemoryStatus now = status();
  if (now.events_lost > events_lost_counted_) {
    problems.count("node.memory", "events_not_kept",
                   "the log has no room for events that could not be written: the oldest are lost",
                   now.events_lost - events_lost_counted_);
    events_lost_counted_ = now.events_lost;
  }
  if (now.failures <= failures_counted_) return;
  problems.count("node.memory", now.stopped ? "nothing_kept" : "not_kept", now.problem,
                 now.failures - failures_counted_);
  failures_counted_ = now.failures;
}

}  // namespace pocd::dds

#include "map_memory.hpp"

#include <chrono>

#include "pocd/common/archive.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"
#include "pocd/memory/memory_reader.hpp"

namespace pocd {
namespace {

template <class Archive>
void archive(Archive& a, MapProgress& p) {
  a.version(1);
  a(p.read, p.unusable, p.first_event, p.frames, p.refused, p.added, p.updated, p.moved, p.removed);
}

std::vector<std::uint8_t> bytes_of(MapProgress progress) {
  SaveArchive a;
  archive(a, progress);
  return a.take();
}

StampNs wall_clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

MapMemory::MapMemory(const MapMemoryOptions& options, const PipelineConfig& config,
                     PocdPipeline& pipeline, MapPublisher& publisher)
    : folder_(options.config.folder), pipeline_(pipeline), publisher_(publisher) {
  if (!options.config.on()) return;
  memory_.emplace(options.config, config.map);
  memory_->restore(pipeline, publisher);
  if (options.resume && memory_->holds_something()) {
    if (memory_->progress().empty()) {
      throw InputError(folder_.string() +
                       ": was last written by a node, whose run has no inputs "
                       "that can be taken up again");
    }
    LoadArchive a(memory_->progress(), folder_.string() + ": progress");
    archive(a, progress_);
    a.finish();
  } else {
    progress_.first_event = pipeline.numbers().event;
  }
  memory_->start(pipeline, config.classes,
                 {0, std::string("pocd_map ") + POCD_VERSION, wall_clock_ns()});
}

void MapMemory::repeat_events(EventsCsv& events, const ClassMap& classes) const {
  if (!memory_ || progress_.read == 0) return;
  MemoryReader log(folder_);
  constexpr std::size_t kMost = 1000;
  std::uint64_t after = progress_.first_event - 1;
  while (true) {
    const std::vector<LoggedEvent> some = log.events(after, kMost);
    for (const LoggedEvent& logged : some) {
      events.add(logged.event, classes.name(logged.event.class_id));
      after = logged.event.sequence;
    }
    if (some.size() < kMost) return;
  }
}

void MapMemory::add(const FrameResult& result) {
  if (memory_) memory_->add(result);
}

void MapMemory::step(const MapProgress& progress, StampNs stamp_ns, FrameResult& result) {
  if (!memory_ || !memory_->due()) return;
  const auto timed = [&](const char* stage, const auto& work) {
    const double wall_ms = clock_ms(CLOCK_MONOTONIC), cpu_ms = thread_cpu_ms();
    work();
    result.timings.push_back(
        {stage, clock_ms(CLOCK_MONOTONIC) - wall_ms, thread_cpu_ms() - cpu_ms});
  };
  timed("publish", [&] { publisher_.update(pipeline_.map()); });
  timed("memory", [&] { memory_->step(pipeline_, publisher_, stamp_ns, bytes_of(progress)); });
}

void MapMemory::finish(const MapProgress& progress, StampNs stamp_ns) {
  if (!memory_) return;
  publisher_.update(pipeline_.map());
  if (!memory_->finish(pipeline_, publisher_, stamp_ns, bytes_of(progress))) {
    throw InputError(memory_->status().problem + ": the end of the run is not in the memory");
  }
}

void MapMemory::note(RunSummary& summary) const {
  if (!memory_) return;
  const MemoryStatus status = memory_->status();
  summary.memory_steps = status.steps;
  summary.memory_written_bytes = status.written_bytes;
  summary.memory_file_bytes = status.file_bytes;
  summary.memory_copy_cpu_ms = status.gather_cpu_ms;
  summary.memory_write_cpu_ms = status.write_cpu_ms;
}

std::optional<std::string> MapMemory::take_problem() {
  if (!memory_) return std::nullopt;
  const MemoryStatus status = memory_->status();
  if (status.failures == failures_told_ || status.problem.empty()) return std::nullopt;
  const bool first = failures_told_ == 0;
  failures_told_ = status.failures;
  if (!first && !status.stopped) return std::nullopt;
  return status.problem +
         (status.stopped ? ": nothing is kept from here on" : ": what changed waits to be kept");
}

}  // namespace pocd

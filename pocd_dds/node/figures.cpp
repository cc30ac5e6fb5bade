#include "pocd_dds/node/figures.hpp"

#include <cstdio>

namespace pocd::dds {
namespace {

class FigureList {
 public:
  void count(const char* key, const char* metric, std::uint64_t value) {
    figures_.push_back({key, std::to_string(value), metric, static_cast<double>(value)});
  }
  /// A time: in ms for diagnostics, in seconds for Prometheus.
  void ms(const char* key, const char* metric, double value_ms) {
    figures_.push_back({key, std::to_string(value_ms), metric, 1e-3 * value_ms});
  }
  void tenths(const char* key, const char* metric, double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.1f", value);
    figures_.push_back({key, text, metric, value});
  }
  void yes_no(const char* key, const char* metric, bool value) {
    figures_.push_back({key, value ? "yes" : "no", metric, value ? 1.0 : 0.0});
  }
  std::vector<Figure> take() { return std::move(figures_); }

 private:
  std::vector<Figure> figures_;
};

void add_map_memory(FigureList& list, const MapMemoryStatus& memory) {
  list.count("map memory [bytes]", "map_memory_bytes", memory.memory_bytes);
  list.count("map blocks in memory", "map_blocks_in_memory", memory.blocks_in_memory);
  if (!memory.limited) return;
  list.count("map memory budget [bytes]", "map_memory_budget_bytes", memory.budget_bytes);
  list.count("map blocks on disk", "map_blocks_on_disk", memory.blocks_on_disk);
  list.count("map disk [bytes]", "map_disk_bytes", memory.disk_bytes);
  list.count("map regions evicted", "map_regions_evicted_total", memory.evictions);
  list.count("map regions brought back", "map_regions_brought_back_total", memory.returns);
  list.count("map regions the disk did not take", "map_regions_not_taken_total",
             memory.write_failures);
  list.count("map blocks lost", "map_blocks_lost_total", memory.blocks_lost);
  list.count("frames over the map memory budget", "frames_over_budget_total",
             memory.frames_over_budget);
}

void add_kept(FigureList& list, const MemoryStatus& kept) {
  list.count("memory steps written", "memory_steps_total", kept.steps);
  list.count("memory steps not written", "memory_steps_failed_total", kept.failures);
  list.count("memory holds map version", "memory_map_version", kept.stored_version);
  list.count("memory holds events to", "memory_last_event", kept.stored_event);
  list.count("memory file [bytes]", "memory_file_bytes", kept.file_bytes);
  list.count("memory written [bytes]", "memory_written_bytes_total", kept.written_bytes);
  list.ms("memory last step [ms]", "memory_last_step_seconds", kept.write_ms);
  list.ms("memory CPU of copying [ms]", "memory_copying_cpu_seconds_total", kept.gather_cpu_ms);
  list.ms("memory CPU of writing [ms]", "memory_writing_cpu_seconds_total", kept.write_cpu_ms);
}

void add_map(FigureList& list, const MapTraffic& map) {
  list.count("map version", "map_version", map.version);
  list.count("map tiles", "map_tiles", map.tiles);
  list.tenths("map area [m2]", "map_area_square_meters", map.area_m2);
  list.count("map bytes published", "map_published_bytes_total",
             map.step_bytes + map.snapshot_bytes);
  list.count("map bytes in snapshots", "map_snapshot_bytes_total", map.snapshot_bytes);
  list.count("map messages waiting", "map_messages_waiting", map.waiting);
}

}  // namespace

FrameSums frame_sums(const NodeReport& report) {
  FrameSums sums{report.intake.departed_frames,
                 report.queue_dropped + report.intake.departed_dropped};
  for (const RobotStatus& robot : report.intake.robots) {
    sums.received += robot.frames;
    sums.dropped += robot.dropped;
  }
  return sums;
}

std::vector<Figure> figures_of(const NodeReport& report) {
  const WorkStatus& work = report.work;
  const FrameSums frames = frame_sums(report);
  FigureList list;
  list.yes_no("ready", "ready", report.state.ready);
  list.tenths("longest time without a turn of a thread [s]", "thread_still_seconds",
              report.state.still_s);
  list.count("times that discovery hung", "discovery_stalls_total", report.state.discovery_stalls);
  list.count("samples not written", "samples_not_written_total", work.write_failures);
  list.count("frames received", "frames_received_total", frames.received);
  list.count("frames processed", "frames_processed_total", work.processed);
  list.count("frames refused", "frames_refused_total", work.refused);
  list.count("frames dropped", "frames_dropped_total", frames.dropped);
  list.count("warnings", "warnings_total", work.warnings);
  list.count("frames in queue", "queue_frames", report.queued);
  add_map_memory(list, work.memory);
  if (work.kept) add_kept(list, *work.kept);
  list.ms("processing [ms per frame]", "processing_seconds", work.processing_ms);
  list.ms("longest from last image to map delta [ms]", "latency_seconds", work.latency_ms);
  list.ms("CPU of the pipeline [ms]", "pipeline_cpu_seconds_total", work.pipeline_cpu_ms);
  list.ms("CPU of publishing [ms]", "publishing_cpu_seconds_total", work.publishing_cpu_ms);
  list.ms("CPU of the intake [ms]", "intake_cpu_seconds_total", work.intake_cpu_ms);
  list.ms("CPU of taking images, within the intake [ms]", "taking_cpu_seconds_total",
          work.take_cpu_ms);
  list.ms("CPU of the process [ms]", "process_cpu_seconds_total", work.process_cpu_ms);
  list.count("objects", "objects", work.objects);
  add_map(list, work.map);
  return list.take();
}

}  // namespace pocd::dds

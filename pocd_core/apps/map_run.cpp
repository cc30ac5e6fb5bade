#include "map_run.hpp"

#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <ostream>

#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/input/message_checks.hpp"
#include "pocd/input/pose_quaternion.hpp"
#include "pocd/map/birdseye.hpp"
#include "pocd/map/map_delta.hpp"
#include "pocd/map/mesh.hpp"
#include "pocd/network/segmentation_network.hpp"
#include "pocd/output/result_csv.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace pocd {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A line on the terminal that renews itself a few times per second.
class Progress {
 public:
  Progress(bool shown, std::size_t total) : shown_(shown), total_(total) {}
  ~Progress() {
    if (shown_) std::fputs("\r\033[K", stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(const RunSummary& summary) {
    const double now = seconds_since(start_);
    if (!shown_ || now - last_ < 0.25) return;
    last_ = now;
    const std::uint64_t done = summary.frames + summary.skipped;
    std::fprintf(stderr, "\r\033[Kframe %llu", static_cast<unsigned long long>(done));
    if (total_ > 0) std::fprintf(stderr, "/%zu", total_);
    std::fprintf(stderr, "  %.1f frames/s", static_cast<double>(done) / now);
  }
  /// Makes room for a line of the log.
  void clear() const {
    if (shown_) std::fputs("\r\033[K", stderr);
  }

 private:
  bool shown_;
  std::size_t total_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double last_ = 0.0;
};

void count(const std::vector<ObjectEvent>& events, MapProgress& progress) {
  for (const ObjectEvent& event : events) {
    switch (event.kind) {
      case EventKind::kAdded:
        ++progress.added;
        break;
      case EventKind::kUpdated:
        ++progress.updated;
        break;
      case EventKind::kMoved:
        ++progress.moved;
        break;
      case EventKind::kRemoved:
        ++progress.removed;
        break;
      case EventKind::kOperator:
        break;
    }
  }
}

void note(const MapProgress& progress, const DatasetReader& reader, RunSummary& summary) {
  summary.frames = progress.frames;
  summary.refused = progress.refused;
  summary.skipped = reader.skipped() + progress.unusable;
  summary.added = progress.added;
  summary.updated = progress.updated;
  summary.moved = progress.moved;
  summary.removed = progress.removed;
}

/// Ids that are no class, in the masks of data sets that are no messages: those are looked at where
/// they become frames.
class UnlistedIds {
 public:
  explicit UnlistedIds(const ClassMap& classes) : table_(classes) {}

  void look(const cv::Mat& labels) {
    pixels_ += labels.total();
    for (int row = 0; row < labels.rows; ++row) {
      const auto* in = labels.ptr<std::uint16_t>(row);
      for (int col = 0; col < labels.cols; ++col) {
        if (!table_.known(in[col])) ++found_[table_.class_of(in[col])];
      }
    }
  }
  /// "" when there are none.
  std::string text() const {
    constexpr std::size_t kMost = 5;
    std::string ids;
    std::uint64_t pixels = 0;
    std::size_t named = 0;
    for (const auto& [id, count] : found_) {
      pixels += count;
      if (++named <= kMost) ids += (ids.empty() ? "" : ", ") + std::to_string(id);
    }
    if (ids.empty()) return "";
    char share[16];
    std::snprintf(share, sizeof share, "%.2g",
                  100.0 * static_cast<double>(pixels) / static_cast<double>(pixels_));
    return "unlisted_class: ids that are no class of classes.list and so background: " + ids +
           (named > kMost ? ", ..." : "") + "; " + share + " % of the pixels";
  }

 private:
  LabelTable table_;
  std::map<int, std::uint64_t> found_;
  std::uint64_t pixels_ = 0;
};

void process_all(const MapRunOptions& options, PocdPipeline& pipeline, MapMemory& memory,
                 RunSummary& summary, std::ostream& log) {
  std::unique_ptr<DatasetReader> reader = open_dataset(options.dataset);
  if (!options.network.empty()) {
    reader = segmented(std::move(reader),
                       std::make_shared<SegmentationNetwork>(
                           options.network, options.config.classes, options.config.threads));
  }
  EventsCsv events(options.output / "events.csv");
  TimingCsv timing(options.output / "timing.csv");
  Progress progress(options.show_progress, reader->size());
  std::size_t reported = 0;
  MapProgress progress_made = memory.progress();
  std::uint64_t already = progress_made.read;  // frames that are in the memory
  memory.repeat_events(events, options.config.classes);
  StampNs stamp_ns = 0;
  UnlistedIds unlisted(options.config.classes);
  const auto report = [&](const std::string& line) {
    progress.clear();
    log << line << '\n';
  };
  while (true) {
    note(progress_made, *reader, summary);
    if ((options.stop && *options.stop) ||
        (options.max_frames && summary.frames >= *options.max_frames)) {
      summary.stopped_early = true;
      break;
    }
    const auto read_start = std::chrono::steady_clock::now();
    const double read_cpu_start_ms = process_cpu_ms();
    std::optional<Frame> frame = reader->next();
    // The pose that a node would get, in every bit; a recording's frames have made that way
    // already.
    if (frame && options.dataset.format != DatasetFormat::kMcap) {
      frame->T_W_C = through_messages(frame->T_W_C, reader->extrinsics().T_B_C);
    }
    const StageTiming read{"read", 1e3 * seconds_since(read_start),
                           process_cpu_ms() - read_cpu_start_ms};
    for (; reported < reader->problems().size(); ++reported) {
      report("skipped: " + reader->problems()[reported]);
    }
    if (!frame) break;
    if (options.dataset.format != DatasetFormat::kMcap) unlisted.look(frame->labels);
    stamp_ns = frame->stamp_ns;
    if (already > 0) {
      --already;
      continue;
    }
    ++progress_made.read;

    FrameResult result;
    try {
      result = pipeline.process_frame(*frame);
    } catch (const InputError& error) {
      ++progress_made.unusable;
      report("skipped: frame " + std::to_string(frame->sequence) + ": " + error.what());
      continue;
    }
    ++progress_made.frames;
    if (!result.accepted) ++progress_made.refused;
    memory.add(result);
    for (const std::string& warning : result.warnings) {
      report("frame " + std::to_string(frame->sequence) + ": " + warning);
    }
    for (const ObjectEvent& event : result.events) {
      events.add(event, options.config.classes.name(event.class_id));
    }
    count(result.events, progress_made);
    memory.step(progress_made, stamp_ns, result);
    if (const auto problem = memory.take_problem()) report(*problem);
    result.timings.insert(result.timings.begin(), read);
    timing.add(*frame, result.timings);
    progress.update(summary);
  }
  note(progress_made, *reader, summary);
  if (!unlisted.text().empty()) report(unlisted.text());
  events.close();
  timing.close();
  memory.finish(progress_made, stamp_ns);
  memory.note(summary);
}

void write_map(const MapRunOptions& options, PocdPipeline& pipeline, MapPublisher& publisher,
               RunSummary& summary, std::ostream& log) {
  publisher.update(pipeline.map());
  if (const auto problem = pipeline.map().take_problem()) {
    log << *problem << '\n';
    publisher.update(pipeline.map());  // without what is lost
  }
  summary.map_digest = publisher.digest().hex();
  summary.map_blocks = pipeline.map().block_count();
  const MapMemoryStatus memory = pipeline.map().memory_status();
  summary.map_memory_bytes = memory.memory_bytes;
  summary.map_blocks_on_disk = memory.blocks_on_disk;
  summary.map_evictions = memory.evictions;
  summary.map_returns = memory.returns;
  summary.map_write_failures = memory.write_failures;
  summary.map_blocks_lost = memory.blocks_lost;
  summary.map_frames_over_budget = memory.frames_over_budget;
  const Mesh mesh = extract_mesh(publisher.tiles(), options.config.map.voxel_size_m,
                                 options.config.map.truncation_m());
  const std::vector<ObjectSnapshot> objects = pipeline.objects();
  summary.objects = objects.size();
  const ClassMap& classes = options.config.classes;
  write_objects_csv(
      objects, [&](ClassId id) { return classes.name(id); }, options.output / "objects.csv");
  write_ply(mesh, appearance_by_stationarity(objects), options.output / "map.ply");
  write_birdseye(mesh, objects, options.output / "birdseye.png");
}

void write_summary(const RunSummary& summary, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  out << dump_config(summary);
  out.close();
  if (!out) throw InputError(file.string() + ": cannot be written in full");
}

}  // namespace

RunSummary run_map(const MapRunOptions& options, std::ostream& log) {
  std::error_code error;
  std::filesystem::create_directories(options.output, error);
  if (error) throw InputError(options.output.string() + ": cannot be made: " + error.message());

  RunSummary summary;
  summary.version = POCD_VERSION;
  summary.dataset = word_of(options.dataset.format);
  for (const auto& input : options.dataset.inputs) summary.inputs.push_back(input.string());
  summary.config = options.config;

  const auto start = std::chrono::steady_clock::now();
  PocdPipeline pipeline(options.config);
  MapPublisher publisher(1, options.config.map);
  MapMemory memory(options.memory, options.config, pipeline, publisher);
  process_all(options, pipeline, memory, summary, log);
  summary.seconds = seconds_since(start);
  if (summary.frames == 0 && !summary.stopped_early) {
    throw InputError("no good frame in the inputs (" + std::to_string(summary.skipped) +
                     " skipped)");
  }
  write_map(options, pipeline, publisher, summary, log);
  write_summary(summary, options.output / "summary.yaml");
  return summary;
}

}  // namespace pocd

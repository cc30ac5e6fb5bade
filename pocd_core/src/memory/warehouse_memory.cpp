#include "pocd/memory/warehouse_memory.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iterator>
#include <mutex>
#include <thread>
#include <utility>

#include "folder_lock.hpp"
#include "gather.hpp"
#include "loader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"
#include "schema.hpp"
#include "step_writer.hpp"

namespace pocd {

using namespace memory;

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds kRetry{1};
constexpr int kLastTries = 3;
/// Numbers are reserved in advance: more than are used between two steps.
constexpr std::uint32_t kReserve = 1 << 16;

double ms_since(Clock::time_point start) {
  return 1e3 * std::chrono::duration<double>(Clock::now() - start).count();
}

std::unique_ptr<Database> open_for_writing(const std::filesystem::path& file) {
  try {
    auto database = std::make_unique<Database>(file, Database::Access::kWrite);
    read_head(*database);  // before anything of another's file is changed
    // A commit is on the disk when it returns: the writer's thread waits, nobody else.
    database->execute(
        "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;"
        "PRAGMA wal_autocheckpoint = 8000; PRAGMA journal_size_limit = 8000000;");
    return database;
  } catch (const DatabaseError& error) {
    throw InputError(error.what());
  }
}

}  // namespace

struct WarehouseMemory::Impl {
  Impl(const MemoryConfig& c, const TsdfConfig& map)
      : config(c),
        folder(c.folder),
        lock(folder),
        file(folder / kFileName),
        database(open_for_writing(file)) {
    try {
      head = prepare(*database, map);
      if (const auto known = read_state(*database)) stored = *known;
    } catch (const DatabaseError& error) {
      throw InputError(error.what());
    }
  }
  ~Impl() { stop(); }

  void stop() {
    {
      const std::lock_guard<std::mutex> guard(mutex);
      stopping = true;
    }
    changed.notify_all();
    if (thread.joinable()) thread.join();
  }
  void write_steps();
  bool write_one(const MemoryStep& step);
  void note_written(double ms);
  void hand_over(std::unique_ptr<MemoryStep> step);
  PocdPipeline::Numbers reserve(const PocdPipeline::Numbers& next);
  void gather(PocdPipeline& pipeline, const MapPublisher& publisher, StampNs stamp_ns, bool clean,
              std::vector<std::uint8_t> progress);

  const MemoryConfig config;
  const std::filesystem::path folder;
  const FolderLock lock;
  const std::filesystem::path file;
  std::unique_ptr<Database> database;  // the writer's thread, once it runs
  FileHead head;
  StoredState stored;  // as it was when the folder was taken; then the pipeline's thread's
  std::int64_t run = 0;
  std::deque<ObjectEvent> events;  // the pipeline's thread
  Clock::time_point last_step{};
  std::unique_ptr<StepWriter> writer;

  mutable std::mutex mutex;  // guards what follows
  mutable std::condition_variable changed;
  std::unique_ptr<MemoryStep> waiting;  // or being written
  MemoryStatus status;
  std::function<void()> on_stored;
  bool stopping = false;
  std::thread thread;
};

// SQLite keeps its own pages beside: what the rows take is what is known here.
void WarehouseMemory::Impl::note_written(double ms) {
  std::error_code error;
  std::uint64_t bytes = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::filesystem::path part = file;
    part += suffix;
    const auto size = std::filesystem::file_size(part, error);
    if (!error) bytes += size;
  }
  const StoredState& state = writer->state();
  const std::lock_guard<std::mutex> guard(mutex);
  ++status.steps;
  status.problem.clear();
  status.stored_stamp_ns = state.stamp_ns;
  status.stored_version = state.map_version;
  status.stored_event = state.last_event;
  status.file_bytes = bytes;
  status.written_bytes = writer->written_bytes();
  status.write_ms = ms;
  status.write_cpu_ms = thread_cpu_ms();  // the thread does nothing else
}

bool WarehouseMemory::Impl::write_one(const MemoryStep& step) {
  const auto start = Clock::now();
  std::string problem;
  bool passing = false;
  try {
    writer->write(step);
  } catch (const DatabaseError& error) {
    problem = error.what();
    passing = error.passing();
  } catch (const std::exception& error) {
    problem = error.what();
  }
  if (problem.empty()) {
    note_written(ms_since(start));
    return true;
  }
  const std::lock_guard<std::mutex> guard(mutex);
  ++status.failures;
  status.problem = problem;
  status.stopped = !passing;
  return false;
}

void WarehouseMemory::Impl::write_steps() {
  int tries_at_end = 0;
  std::unique_lock<std::mutex> guard(mutex);
  while (true) {
    changed.wait(guard, [this] { return stopping || waiting; });
    if (!waiting) return;
    const MemoryStep& step = *waiting;
    guard.unlock();
    const bool done = write_one(step);
    guard.lock();
    if (done) {
      waiting.reset();
      changed.notify_all();
      if (on_stored) on_stored();
    } else {
      changed.notify_all();
      if (status.stopped || (stopping && ++tries_at_end >= kLastTries)) return;
      changed.wait_for(guard, kRetry, [this] { return stopping; });
    }
  }
}

void WarehouseMemory::Impl::hand_over(std::unique_ptr<MemoryStep> step) {
  std::unique_lock<std::mutex> guard(mutex);
  changed.wait(guard, [this] { return !waiting || status.stopped || stopping; });
  if (status.stopped || stopping) return;
  waiting = std::move(step);
  changed.notify_all();
}

PocdPipeline::Numbers WarehouseMemory::Impl::reserve(const PocdPipeline::Numbers& next) {
  PocdPipeline::Numbers& reserved = stored.reserved;
  if (next.object + kReserve / 2 > reserved.object) reserved.object = next.object + kReserve;
  if (next.event + kReserve / 2 > reserved.event) reserved.event = next.event + kReserve;
  return reserved;
}

void WarehouseMemory::Impl::gather(PocdPipeline& pipeline, const MapPublisher& publisher,
                                   StampNs stamp_ns, bool clean,
                                   std::vector<std::uint8_t> progress) {
  const double cpu_start_ms = thread_cpu_ms();
  last_step = Clock::now();
  auto step = std::make_unique<MemoryStep>();
  gather_changes(pipeline, publisher, *step);
  step->events.assign(std::make_move_iterator(events.begin()),
                      std::make_move_iterator(events.end()));
  events.clear();
  step->state.run = run;
  step->state.clean = clean;
  step->state.stamp_ns = stamp_ns;
  step->state.map_version = publisher.version();
  step->state.digest = publisher.digest();
  step->state.next = pipeline.numbers();
  step->state.reserved = reserve(step->state.next);
  step->state.progress = std::move(progress);
  const double cpu_ms = thread_cpu_ms() - cpu_start_ms;
  hand_over(std::move(step));
  const std::lock_guard<std::mutex> guard(mutex);
  status.gather_cpu_ms += cpu_ms;
  status.events_waiting = 0;
}

WarehouseMemory::WarehouseMemory(const MemoryConfig& config, const TsdfConfig& map)
    : impl_(std::make_unique<Impl>(config, map)) {}
WarehouseMemory::~WarehouseMemory() = default;

std::uint64_t WarehouseMemory::lineage() const { return impl_->head.lineage; }
bool WarehouseMemory::holds_something() const { return impl_->stored.step > 0; }
bool WarehouseMemory::ended_clean() const { return impl_->stored.clean; }
StampNs WarehouseMemory::stamp_ns() const { return impl_->stored.stamp_ns; }
PocdPipeline::Numbers WarehouseMemory::reserved() const { return impl_->stored.reserved; }
const std::vector<std::uint8_t>& WarehouseMemory::progress() const {
  return impl_->stored.progress;
}

void WarehouseMemory::restore(PocdPipeline& pipeline, MapPublisher& publisher) {
  if (!holds_something()) return;
  Impl& m = *impl_;
  try {
    Loaded loaded = load(*m.database, m.stored);
    pipeline.restore(loaded.pieces);
    pipeline.map().restore(loaded.regions, std::make_shared<StoredVoxels>(m.file));
    if (m.stored.map_version > 0) {
      publisher.restore(m.stored.map_version, m.stored.digest, std::move(loaded.tiles));
    }
  } catch (const DatabaseError& error) {
    throw InputError(error.what());
  } catch (const InputError& error) {
    const std::string what = error.what(), name = m.file.string();
    throw InputError(what.find(name) == std::string::npos ? name + ": " + what : what);
  }
}

void WarehouseMemory::start(PocdPipeline& pipeline, const ClassMap& classes, const MemoryRun& run) {
  Impl& m = *impl_;
  POCD_CHECK(!m.thread.joinable());
  try {
    m.run = start_run(*m.database, classes, run, pipeline.numbers().event);
    m.writer = std::make_unique<StepWriter>(*m.database, m.config, m.stored);
  } catch (const DatabaseError& error) {
    throw InputError(error.what());
  }
  // From here on what changes is noted; what was restored is on disk already.
  pipeline.map().keep_unsaved();
  pipeline.note_looks();
  m.thread = std::thread([&m] { m.write_steps(); });
}

void WarehouseMemory::add(const FrameResult& result) {
  Impl& m = *impl_;
  if (result.events.empty()) return;
  m.events.insert(m.events.end(), result.events.begin(), result.events.end());
  const std::lock_guard<std::mutex> guard(m.mutex);
  const std::size_t most = m.status.stopped ? 0 : kMostWaiting;
  for (; m.events.size() > most; ++m.status.events_lost) m.events.pop_front();
  m.status.events_waiting = m.events.size();
}

bool WarehouseMemory::due() const {
  const Impl& m = *impl_;
  if (std::chrono::duration<double>(Clock::now() - m.last_step).count() < m.config.period_s) {
    return false;
  }
  return free();
}

bool WarehouseMemory::free() const {
  const std::lock_guard<std::mutex> guard(impl_->mutex);
  return !impl_->waiting && !impl_->status.stopped;
}

void WarehouseMemory::step(PocdPipeline& pipeline, const MapPublisher& publisher, StampNs stamp_ns,
                           std::vector<std::uint8_t> progress) {
  impl_->gather(pipeline, publisher, stamp_ns, false, std::move(progress));
}

bool WarehouseMemory::finish(PocdPipeline& pipeline, const MapPublisher& publisher,
                             StampNs stamp_ns, std::vector<std::uint8_t> progress) {
  Impl& m = *impl_;
  m.gather(pipeline, publisher, stamp_ns, true, std::move(progress));
  m.stop();
  if (m.waiting || m.status.stopped) return false;
  try {
    end_run(*m.database, m.run);
  } catch (const DatabaseError&) {  // all of the map is there; only its log of changes stays
    return false;
  }
  return true;
}

MemoryStatus WarehouseMemory::status() const {
  const std::lock_guard<std::mutex> guard(impl_->mutex);
  return impl_->status;
}

void WarehouseMemory::on_stored(std::function<void()> called) {
  const std::lock_guard<std::mutex> guard(impl_->mutex);
  impl_->on_stored = std::move(called);
}

}  // namespace pocd

// The bus into an MCAP file.
#include <unistd.h>

#include <chrono>

#include "apps/common.hpp"
#include "apps/heap_return.hpp"
#include "pocd/common/choice_option.hpp"
#include "pocd_dds/recording/recorder.hpp"

namespace {

using Clock = std::chrono::steady_clock;

/// One line that renews itself on a terminal, and a log line now and then elsewhere.
class StatusLine {
 public:
  explicit StatusLine(bool terminal) : terminal_(terminal) {}

  void update(const pocd::dds::RecorderStatus& now) {
    const double elapsed_s = std::chrono::duration<double>(Clock::now() - last_time_).count();
    if (elapsed_s < (terminal_ ? 1.0 : 10.0)) return;
    const double rate = static_cast<double>(now.bytes - last_bytes_) * 1e-6 / elapsed_s;
    last_bytes_ = now.bytes;
    last_time_ = Clock::now();
    const std::string line = fmt::format(
        "{} topics, {} messages, {:.1f} MB/s, {:.1f} MB in {} file(s), {} dropped, {} lost",
        now.topics, now.messages, rate, static_cast<double>(now.file_bytes) * 1e-6, now.files,
        now.dropped, now.lost);
    if (terminal_) {
      std::fprintf(stderr, "\r\033[K%s", line.c_str());
    } else {
      spdlog::info("{}", line);
    }
  }
  void clear() const {
    if (terminal_) std::fputs("\r\033[K", stderr);
  }

 private:
  bool terminal_;
  Clock::time_point last_time_ = Clock::now();
  std::uint64_t last_bytes_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Records topics of the bus into an MCAP file, whatever their types.\n"
      "Example: pocd_record --output run.mcap --topic '/robot_*' --topic '/tf*'\n"
      "Runs until SIGINT, SIGTERM or SIGHUP. Killed, it leaves a file that can be read up to the "
      "last "
      "second.\n"
      "Exit code: 0 recorded without loss, 1 samples were dropped or the file could not be "
      "written, "
      "2 usage.",
      "pocd_record");
  pocd::dds::RecorderOptions options;
  options.bus.name = "pocd_record";
  std::vector<std::string> topics;
  double split_mb = 0.0, split_s = 0.0, ring_mb = 0.0, queue_mb = 512.0;
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("--output", options.output, "File to write; with --split-*, FILE_0000.mcap ...")
      ->required();
  app.add_flag("--overwrite", options.overwrite, "Replace files that are there already");
  app.add_option("--topic", topics,
                 "Pattern of topics (*, ?, [..]); ROS topics begin with /; default: all; repeat it")
      ->allow_extra_args(false);
  app.add_option("--exclude", options.exclude, "Pattern of topics to leave out; repeat it")
      ->allow_extra_args(false);
  app.add_flag("--rerun", options.rerun,
               "Also what Rerun's viewer shows: colours of clouds, boxes of markers, poses of "
               "odometry; clouds get a field \"colors\", the rest topics of its own, TOPIC/rerun");
  pocd::add_choice(app, "--compression", options.split.mcap.compression, "Of the chunks");
  app.add_option("--level", options.split.mcap.level, "Level of zstd")
      ->check(CLI::Range(-7, 19))
      ->capture_default_str();
  app.add_option("--split-size", split_mb, "Begin another file after this many MB")
      ->check(CLI::Range(0.1, 1e9));
  app.add_option("--split-duration", split_s, "Begin another file after this many seconds")
      ->check(CLI::Range(0.1, 1e9));
  app.add_option("--ring", ring_mb,
                 "Keep the last so many MB: the oldest files are removed, also those of earlier "
                 "runs, after which it goes on; files of a tenth of it, unless --split-* say so")
      ->check(CLI::Range(1.0, 1e9));
  app.add_option("--queue", queue_mb, "MB received and not yet written before samples are dropped")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  int domain = -1;
  pocd::dds::add_bus_options(app, domain, options.bus.profiles_file, options.bus.security_folder);
  try {
    app.parse(argc, argv);
    if (ring_mb > 0.0 && split_mb > 0.5 * ring_mb) {
      throw CLI::ValidationError("--split-size", "is more than half of --ring");
    }
    options.bus.domain = domain >= 0 ? domain : pocd::dds::default_domain();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_record: " << error.what() << '\n';
    return 2;
  }
  if (!topics.empty()) options.topics = topics;
  if (ring_mb > 0.0 && split_mb == 0.0) split_mb = 0.1 * ring_mb;
  options.split.most_bytes = static_cast<std::uint64_t>(split_mb * 1e6);
  options.split.keep_bytes = static_cast<std::uint64_t>(ring_mb * 1e6);
  options.split.most_duration_ns = static_cast<std::uint64_t>(split_s * 1e9);
  options.queue_bytes = static_cast<std::size_t>(queue_mb * 1e6);

  return pocd::dds::guarded("pocd_record", [&] {
    pocd::dds::log_to_stderr("pocd_record");
    pocd::dds::stop_on_signals();
    pocd::dds::Recorder recorder(options);
    spdlog::info("recording on domain {} into {}", options.bus.domain, options.output.string());
    StatusLine line(isatty(STDERR_FILENO) != 0);
    pocd::dds::HeapReturn heap;
    while (!pocd::dds::stop_requested) {
      heap.turn();
      recorder.step(std::chrono::milliseconds(100));
      line.update(recorder.status());
    }
    line.clear();
    recorder.stop();
    const pocd::dds::RecorderStatus status = recorder.status();
    std::cout << status.messages << " messages of " << status.topics << " topics, "
              << status.file_bytes << " bytes in " << status.files << " file(s), " << status.dropped
              << " dropped, " << status.lost << " lost\n";
    for (const auto& [what, count] : status.left_out_for_rerun) {
      std::cout << "not in the form for Rerun: " << count << " of " << what << '\n';
    }
    if (status.dropped > 0) spdlog::error("samples were dropped: the disk is too slow");
    return std::cout.flush() && status.dropped == 0 ? 0 : 1;
  });
}

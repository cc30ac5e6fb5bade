#include "pocd_dds/watch/metrics_endpoint.hpp"

#include <dirent.h>
#include <prometheus/collectable.h>
#include <prometheus/exposer.h>
#include <prometheus/metric_family.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "pocd/common/check.hpp"
#include "pocd_dds/node/figures.hpp"

namespace pocd::dds {
namespace {

using Clock = std::chrono::steady_clock;
using Labels = std::vector<prometheus::ClientMetric::Label>;

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Families in the order in which their first metric came.
class Families {
 public:
  explicit Families(Labels common) : common_(std::move(common)) {}

  void add(const std::string& name, const std::string& help, double value,
           const Labels& labels = {}) {
    auto family = std::find_if(families_.begin(), families_.end(),
                               [&](const auto& known) { return known.name == name; });
    if (family == families_.end()) {
      families_.emplace_back();
      family = std::prev(families_.end());
      family->name = name;
      family->help = help;
      family->type = ends_with(name, "_total") ? prometheus::MetricType::Counter
                                               : prometheus::MetricType::Gauge;
    }
    prometheus::ClientMetric metric;
    metric.label = common_;
    metric.label.insert(metric.label.end(), labels.begin(), labels.end());
    (family->type == prometheus::MetricType::Counter ? metric.counter.value : metric.gauge.value) =
        value;
    family->metric.push_back(std::move(metric));
  }
  std::vector<prometheus::MetricFamily> take() { return std::move(families_); }

 private:
  const Labels common_;
  std::vector<prometheus::MetricFamily> families_;
};

/// As the node's log has it.
std::string hexadecimal(std::uint64_t epoch) {
  char text[20];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(epoch));
  return text;
}

std::size_t entries_of(const char* folder) {
  DIR* const open = opendir(folder);
  if (open == nullptr) return 0;
  std::size_t count = 0;
  while (const dirent* entry = readdir(open)) count += entry->d_name[0] != '.' ? 1 : 0;
  closedir(open);
  return count;
}

/// Under the names that Prometheus' client libraries give them.
void add_process(Families& families) {
  std::ifstream statm("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  if (statm >> pages >> resident) {
    const auto page = static_cast<double>(sysconf(_SC_PAGESIZE));
    families.add("process_virtual_memory_bytes", "Virtual memory", page * pages);
    families.add("process_resident_memory_bytes", "Resident memory", page * resident);
  }
  families.add("process_open_fds", "Open file handles",
               static_cast<double>(entries_of("/proc/self/fd")));
  families.add("process_threads", "Threads", static_cast<double>(entries_of("/proc/self/task")));
}

void add_robots(Families& families, const IntakeStatus& intake) {
  for (const RobotStatus& robot : intake.robots) {
    const Labels label{{"robot", robot.name}};
    families.add("pocd_robot_present", "It has a source of depth images", robot.live, label);
    families.add("pocd_robot_waiting", "Its frames wait for a stream or a frame of reference",
                 robot.waiting_for.empty() ? 0.0 : 1.0, label);
    families.add("pocd_robot_frames_total", "Its complete frames",
                 static_cast<double>(robot.frames), label);
    families.add("pocd_robot_frames_dropped_total", "Its frames that stayed incomplete",
                 static_cast<double>(robot.dropped), label);
    families.add("pocd_robot_images_lost_total", "Its depth images that the bus lost",
                 static_cast<double>(robot.lost), label);
  }
}

}  // namespace

struct MetricsEndpoint::Impl : prometheus::Collectable {
  std::vector<prometheus::MetricFamily> Collect() const override {
    const std::lock_guard<std::mutex> lock(mutex);
    Families families({{"node", options.node}});
    families.add("pocd_info", "Always 1; what runs", 1.0,
                 {{"version", options.version}, {"epoch", hexadecimal(options.epoch)}});
    add_process(families);
    if (!report) return families.take();
    families.add("pocd_level", "0 ok, 1 warning, 2 error", report->state.verdict.level);
    families.add("pocd_status_age_seconds", "Since the node last said how it is",
                 std::chrono::duration<double>(Clock::now() - updated).count());
    for (const Figure& figure : figures_of(*report)) {
      const std::string key = figure.key;
      families.add(std::string("pocd_") + figure.metric, key.substr(0, key.find(" [")),
                   figure.value);
    }
    families.add("pocd_robots", "Robots with a source of depth images",
                 static_cast<double>(std::count_if(report->intake.robots.begin(),
                                                   report->intake.robots.end(),
                                                   [](const auto& robot) { return robot.live; })));
    add_robots(families, report->intake);
    for (const ProblemCounter::Entry& problem : report->intake.problems) {
      families.add("pocd_problems_total", "Bad input and what else is wrong on the bus",
                   static_cast<double>(problem.count),
                   {{"topic", problem.topic}, {"reason", problem.reason}});
    }
    return families.take();
  }

  MetricsOptions options;
  mutable std::mutex mutex;
  std::optional<NodeReport> report;
  Clock::time_point updated{};
};

MetricsEndpoint::MetricsEndpoint(const MetricsOptions& options) : impl_(std::make_shared<Impl>()) {
  impl_->options = options;
  const bool port_only = options.address.find_first_not_of("0123456789") == std::string::npos;
  const std::string address = port_only ? "127.0.0.1:" + options.address : options.address;
  try {
    exposer_ = std::make_unique<prometheus::Exposer>(address);
  } catch (const std::exception&) {
    throw InputError("--metrics " + options.address +
                     ": cannot be listened on; expected PORT or ADDRESS:PORT that is free");
  }
  exposer_->RegisterCollectable(impl_);
}

MetricsEndpoint::~MetricsEndpoint() = default;

void MetricsEndpoint::update(const NodeReport& report) {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  impl_->report = report;
  impl_->updated = Clock::now();
}

int MetricsEndpoint::port() const { return exposer_->GetListeningPorts().at(0); }

}  // namespace pocd::dds

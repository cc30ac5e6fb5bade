#include "pocd_dds/entities/bus_log.hpp"

#include <cstdio>
#include <fastdds/dds/log/Log.hpp>
#include <memory>
#include <mutex>

namespace pocd {
namespace {

struct Sink {
  std::mutex mutex;
  BusLog log;
};

// Never destroyed: threads of the middleware may still have something to say at the very end.
Sink& sink() {
  static Sink* const the_sink = new Sink;
  return *the_sink;
}

void to_stderr(LogLevel level, const std::string& text) {
  const char* const name = level == LogLevel::kInfo      ? "info"
                           : level == LogLevel::kWarning ? "warning"
                                                         : "error";
  std::fprintf(stderr, "pocd: %s: %s\n", name, text.c_str());
}

/// Messages of Fast DDS, without the place in its sources.
class FastDdsMessages : public eprosima::fastdds::dds::LogConsumer {
 public:
  void Consume(const eprosima::fastdds::dds::Log::Entry& entry) override {
    using eprosima::fastdds::dds::Log;
    const LogLevel level = entry.kind == Log::Kind::Error     ? LogLevel::kError
                           : entry.kind == Log::Kind::Warning ? LogLevel::kWarning
                                                              : LogLevel::kInfo;
    dds::log(level, std::string("Fast DDS: ") + entry.message);
  }
};

}  // namespace

void set_bus_log(BusLog log) {
  using eprosima::fastdds::dds::Log;
  static std::once_flag once;
  if (log) {
    std::call_once(once, [] {
      Log::ClearConsumers();
      Log::RegisterConsumer(std::make_unique<FastDdsMessages>());
    });
  }
  const std::lock_guard<std::mutex> lock(sink().mutex);
  sink().log = std::move(log);
}

namespace dds {

void log(LogLevel level, const std::string& text) noexcept {
  try {
    Sink& to = sink();
    const std::lock_guard<std::mutex> lock(to.mutex);
    if (to.log) {
      to.log(level, text);
    } else {
      to_stderr(level, text);
    }
  } catch (...) {  // a message is not worth more than that
  }
}

}  // namespace dds
}  // namespace pocd

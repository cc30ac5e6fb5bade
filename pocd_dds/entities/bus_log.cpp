#include "pocd_dds/entities/bus_log.hpp"

#include <cstdio>
#include <exception>
#include <fastdds/dds/log/Log.hpp>
#include <memory>
#include <mutex>

#include "pocd/common/check.hpp"

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

thread_local bool within = false;

/// Calls the process's function; what it throws, it throws.
void call(const BusLog& log, LogLevel level, const std::string& text) {
  struct Within {
    Within() { within = true; }
    ~Within() { within = false; }
  } const marked;
  log(level, text);
}

void fell_back(LogLevel level, const std::string& text, const char* thrown) {
  dds::log_to_stderr_only(level, text);
  dds::log_to_stderr_only(LogLevel::kError,
                          std::string("the function given to set_bus_log has thrown: ") + thrown);
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
  if (within) throw InputError("set_bus_log is called by the function that was given to it");
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
    if (within) return log_to_stderr_only(level, text);  // the lock is this thread's already
    Sink& to = sink();
    const std::lock_guard<std::mutex> lock(to.mutex);
    if (!to.log) return log_to_stderr_only(level, text);
    try {
      call(to.log, level, text);
    } catch (const std::exception& error) {
      fell_back(level, text, error.what());
    } catch (...) {
      fell_back(level, text, "something that is no std::exception");
    }
  } catch (...) {  // a message is not worth more than that
  }
}

bool within_bus_log() { return within; }

void log_to_stderr_only(LogLevel level, const std::string& text) {
  const char* const name = level == LogLevel::kInfo      ? "info"
                           : level == LogLevel::kWarning ? "warning"
                                                         : "error";
  std::fprintf(stderr, "pocd: %s: %s\n", name, text.c_str());
}

}  // namespace dds
}  // namespace pocd

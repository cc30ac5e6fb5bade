// Where the library's messages go. No DDS type shows here.
#pragma once

#include <functional>
#include <string>

namespace pocd {

enum class LogLevel { kInfo, kWarning, kError };

/// Called by any thread, one call at a time. When it throws, what it was to say and what it has
/// thrown go to stderr.
///
/// It must not make or delete a `MapMirror` or an `ObjectWatch`: their threads may wait for it with
/// a message of their own. A reader that is made in it throws `InputError`, one that is deleted in
/// it is said so on stderr.
using BusLog = std::function<void(LogLevel, const std::string& text)>;

/// For the whole process: every message of this library goes to `log` from here on, and those of
/// Fast DDS, whose own consumers of messages are replaced. Without a call, this library writes to
/// stderr and Fast DDS's settings stay as they are; nothing is ever written to stdout. An empty
/// function: back to stderr. Thread-safe; when it returns, the log before is not in use any more.
/// Throws InputError when it is called by a log.
void set_bus_log(BusLog log);

}  // namespace pocd

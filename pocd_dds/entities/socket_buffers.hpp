// Whether the kernel gives sockets the buffers that large messages need.
#pragma once

#include <string>

namespace pocd::dds {

/// Empty when a UDP socket gets receive and send buffers of this size; else one line that says what
/// it gets and what to set.
std::string socket_buffer_problem(int bytes);

}  // namespace pocd::dds

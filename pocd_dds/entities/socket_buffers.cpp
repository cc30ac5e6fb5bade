#include "pocd_dds/entities/socket_buffers.hpp"

#include <sys/socket.h>
#include <unistd.h>

namespace pocd::dds {
namespace {

/// What a socket gets when it asks for that much. The limit is tried out and not read: in a
/// container the kernel does not show it.
int granted(int socket, int option, int bytes) {
  setsockopt(socket, SOL_SOCKET, option, &bytes, sizeof bytes);
  int got = 0;
  socklen_t size = sizeof got;
  getsockopt(socket, SOL_SOCKET, option, &got, &size);
  return got / 2;  // the kernel counts its own bookkeeping in and reports twice the value
}

std::string describe(const char* direction, const char* key, int got, int bytes) {
  if (got >= bytes) return "";
  return std::string(direction) + " " + std::to_string(got) + " bytes (sysctl -w net.core." + key +
         "=" + std::to_string(bytes) + ")";
}

}  // namespace

std::string socket_buffer_problem(int bytes) {
  const int probe = socket(AF_INET, SOCK_DGRAM, 0);
  if (probe < 0) return "";  // no network: Fast DDS has its own word for that
  const std::string receive =
      describe("receive", "rmem_max", granted(probe, SO_RCVBUF, bytes), bytes);
  const std::string send = describe("send", "wmem_max", granted(probe, SO_SNDBUF, bytes), bytes);
  close(probe);
  if (receive.empty() && send.empty()) return "";
  return "UDP socket buffers are small, large messages from other hosts will be lost: " + receive +
         (receive.empty() || send.empty() ? "" : ", ") + send;
}

}  // namespace pocd::dds

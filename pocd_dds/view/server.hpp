// The page's files and its clients, on one port.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "view/board.hpp"
#include "view/relay.hpp"
#include "view/source.hpp"
#include "view/static_files.hpp"

namespace pocd::view {

struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  ///< 0: any that is free
  std::string token;          ///< WebSocket clients have to give it, ?token=...; empty: none
  /// Origins of other people's pages that may connect, like "https://app.foxglove.dev"; programs,
  /// which name no origin, and our own page always may.
  std::vector<std::string> allowed_origins;
  std::size_t most_clients = 64;
};

/// Serves files by GET and HEAD, the page by the subprotocol pocd.view.v1 and other viewers by
/// foxglove.*.v1. A request that is too large, too slow, or no HTTP ends its connection. One
/// thread, from construction on.
class Server {
 public:
  /// All must outlive it; `source` may be null (then nobody's past is known). Throws InputError
  /// when the address or port cannot be had.
  Server(const ServerOptions& options, const StaticFiles& files, Board& board, const Source* source,
         Relay& relay);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::view

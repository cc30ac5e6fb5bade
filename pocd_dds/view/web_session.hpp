// One client on a WebSocket: what it may send, and how it is sent to.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace pocd::view {

/// Nothing is queued: the next message is made when the one before has gone. All of it runs on the
/// server's thread.
class WebSession : public std::enable_shared_from_this<WebSession> {
 public:
  static constexpr std::size_t kLargestMessage = 64 * 1024;  ///< from a client
  static constexpr double kMostPerSecond = 100.0;            ///< messages of a client, on average,
  static constexpr double kMostAtOnce = 400.0;               ///< and in a burst

  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  explicit WebSession(boost::beast::tcp_stream&& stream);
  virtual ~WebSession();

  /// Answers the request; `subprotocol` may be empty.
  void accept(const Request& request, const std::string& subprotocol);
  /// There may be something to send.
  void pump();
  void end(const std::string& reason);
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  const std::string& peer() const { return peer_; }

 protected:
  struct Outgoing {
    std::string data;
    bool binary = false;
  };
  /// An empty text: goes on. Else the client has sent something wrong, and is told so and ended.
  virtual std::string received(const std::string& message, bool binary) = 0;
  virtual std::optional<Outgoing> next() = 0;
  /// It will have something to send soon without being pumped from outside.
  virtual bool busy() const { return false; }

 private:
  void read();
  void pump_later();
  bool within_rate();

  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  boost::beast::flat_buffer buffer_;
  std::optional<Outgoing> writing_;
  boost::asio::steady_timer timer_;
  bool open_ = false, ending_ = false, timer_set_ = false;
  double allowance_ = kMostAtOnce;
  std::chrono::steady_clock::time_point counted_ = std::chrono::steady_clock::now();
  std::uint64_t bytes_sent_ = 0;
  std::string peer_;
};

}  // namespace pocd::view

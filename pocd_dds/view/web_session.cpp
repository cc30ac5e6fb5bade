#include "view/web_session.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>

namespace pocd::view {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

namespace {

// What is on its way in the kernel is out of date when it arrives: little of it.
constexpr int kSendBuffer = 256 * 1024;
constexpr std::chrono::milliseconds kBusyPeriod{50};

}  // namespace

WebSession::WebSession(beast::tcp_stream&& stream)
    : socket_(std::move(stream)), timer_(socket_.get_executor()) {
  auto& tcp = beast::get_lowest_layer(socket_).socket();
  error_code ignored;
  tcp.set_option(boost::asio::socket_base::send_buffer_size(kSendBuffer), ignored);
  tcp.set_option(boost::asio::ip::tcp::no_delay(true), ignored);
  const auto remote = tcp.remote_endpoint(ignored);
  if (!ignored) peer_ = remote.address().to_string() + ':' + std::to_string(remote.port());
}

WebSession::~WebSession() {
  if (open_)
    spdlog::info("{}: has gone, {:.1f} MB sent", peer_, 1e-6 * static_cast<double>(bytes_sent_));
}

void WebSession::accept(const Request& request, const std::string& subprotocol) {
  // Without any sign of life, also none to a ping, for that long it is gone.
  websocket::stream_base::timeout patience{};
  patience.handshake_timeout = std::chrono::seconds(10);
  patience.idle_timeout = std::chrono::seconds(30);
  patience.keep_alive_pings = true;
  beast::get_lowest_layer(socket_).expires_never();
  socket_.set_option(patience);
  socket_.read_message_max(kLargestMessage);
  socket_.auto_fragment(false);
  if (!subprotocol.empty()) {
    socket_.set_option(
        websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
          response.set(beast::http::field::sec_websocket_protocol, subprotocol);
        }));
  }
  socket_.async_accept(request, [self = shared_from_this()](error_code error) {
    if (error) return;
    self->open_ = true;
    spdlog::info("{}: is here", self->peer_);
    self->read();
    self->pump();
  });
}

bool WebSession::within_rate() {
  const auto now = std::chrono::steady_clock::now();
  allowance_ += kMostPerSecond * std::chrono::duration<double>(now - counted_).count();
  allowance_ = std::min(allowance_, kMostAtOnce) - 1.0;
  counted_ = now;
  return allowance_ >= 0.0;
}

void WebSession::read() {
  socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
    if (error) {
      self->ending_ = true;
      return;
    }
    const std::string message = beast::buffers_to_string(self->buffer_.data());
    self->buffer_.consume(self->buffer_.size());
    const std::string wrong = self->within_rate()
                                  ? self->received(message, self->socket_.got_binary())
                                  : "more messages than a client may send";
    if (!wrong.empty()) {
      spdlog::warn("{}: ended, {}", self->peer_, wrong);
      self->end(wrong);
      return;
    }
    self->pump();
    self->read();
  });
}

void WebSession::pump() {
  if (!open_ || ending_ || writing_) return;
  writing_ = next();
  if (!writing_) {
    if (busy()) pump_later();
    return;
  }
  socket_.binary(writing_->binary);
  socket_.async_write(boost::asio::buffer(writing_->data),
                      [self = shared_from_this()](error_code error, std::size_t bytes) {
                        self->writing_.reset();
                        self->bytes_sent_ += bytes;
                        if (error) {
                          self->ending_ = true;
                          return;
                        }
                        self->pump();
                      });
}

void WebSession::pump_later() {
  if (timer_set_) return;
  timer_set_ = true;
  timer_.expires_after(kBusyPeriod);
  timer_.async_wait([weak = weak_from_this()](error_code) {
    const auto self = weak.lock();
    if (!self) return;
    self->timer_set_ = false;
    self->pump();
  });
}

void WebSession::end(const std::string& reason) {
  if (ending_) return;
  ending_ = true;
  if (!open_) {
    beast::get_lowest_layer(socket_).close();
    return;
  }
  // The limit is that of the protocol for a control frame. Who does not answer is cut off.
  socket_.async_close(
      websocket::close_reason(websocket::close_code::policy_error, reason.substr(0, 120)),
      [self = shared_from_this()](error_code) { beast::get_lowest_layer(self->socket_).close(); });
}

}  // namespace pocd::view

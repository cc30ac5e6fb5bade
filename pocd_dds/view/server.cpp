#include "view/server.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/http.hpp>
#include <list>
#include <thread>

#include "pocd/common/check.hpp"
#include "view/foxglove_session.hpp"
#include "view/http_rules.hpp"
#include "view/page_session.hpp"

namespace pocd::view {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;
using tcp = asio::ip::tcp;

namespace {

constexpr std::chrono::milliseconds kPumpPeriod{50};
constexpr std::chrono::seconds kRequestTime{10};
constexpr std::uint32_t kLargestHead = 8 * 1024;
constexpr std::size_t kLargestBody = 1024;        // nobody sends one
constexpr std::size_t kConnectionsBesides = 128;  // that are no WebSocket clients (yet)

}  // namespace

struct Server::Impl {
  class Connection;

  Impl(const ServerOptions& given, const StaticFiles& page, Board& b, const Source* s, Relay& r)
      : options(given),
        files(page),
        board(b),
        source(s),
        relay(r),
        acceptor(context),
        timer(context),
        accept_timer(context) {
    listen();
    board.set_listener([this] { wake(); });
    relay.set_listener([this] { wake(); });
    thread = std::thread([this] { context.run(); });
  }
  ~Impl() {
    board.set_listener(nullptr);
    relay.set_listener(nullptr);
    context.stop();
    thread.join();
  }

  void listen();
  void accept();
  void wake();
  void pump_all();
  bool room();
  std::shared_ptr<WebSession> session_of(beast::tcp_stream&& stream,
                                         const std::string& subprotocol);

  const ServerOptions options;
  const StaticFiles& files;
  Board& board;
  const Source* source;
  Relay& relay;
  asio::io_context context{1};
  tcp::acceptor acceptor;
  asio::steady_timer timer, accept_timer;
  bool timer_set = false;
  std::atomic<bool> awake{false};
  std::list<std::weak_ptr<WebSession>> sessions;
  std::size_t connections = 0;
  std::thread thread;
};

/// Requests of one TCP connection, until it asks for a WebSocket.
class Server::Impl::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Impl& server, tcp::socket&& socket) : server_(server), stream_(std::move(socket)) {
    ++server_.connections;
  }
  ~Connection() { --server_.connections; }

  void read() {
    parser_.emplace();
    parser_->header_limit(kLargestHead);
    parser_->body_limit(kLargestBody);
    stream_.expires_after(kRequestTime);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t) {
                       if (!error) self->handle();
                     });
  }

 private:
  void handle() {
    const auto request = parser_->release();
    if (beast::websocket::is_upgrade(request)) {
      upgrade(request);
      return;
    }
    answer(request);
  }

  void upgrade(const WebSession::Request& request) {
    const RequestRules rules{server_.options.address, server_.options.token,
                             server_.options.allowed_origins};
    const std::string refused = refusal(request, rules);
    if (!refused.empty()) {
      spdlog::warn("a WebSocket client is refused: {}", refused);
      send(request, http::status::forbidden, refused + '\n');
      return;
    }
    const std::string subprotocol = chosen_subprotocol(request);
    if (subprotocol.empty()) {
      send(request, http::status::bad_request,
           "subprotocols: pocd.view.v1, foxglove.sdk.v1, foxglove.websocket.v1\n");
      return;
    }
    if (!server_.room()) {
      send(request, http::status::service_unavailable, "too many clients\n");
      return;
    }
    const auto session = server_.session_of(std::move(stream_), subprotocol);
    server_.sessions.push_back(session);
    session->accept(request, subprotocol);
  }

  void answer(const WebSession::Request& request) {
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      send(request, http::status::method_not_allowed, "GET or HEAD\n");
      return;
    }
    if (!host_allowed(request, server_.options.address)) {
      send(request, http::status::forbidden, "this server has another name\n");
      return;
    }
    const std::string target(request.target());
    const StaticFile* file = server_.files.find(target.substr(0, target.find('?')));
    if (file == nullptr) {
      send(request, http::status::not_found, "not found\n");
      return;
    }
    if (request[http::field::if_none_match] == file->tag) {
      send(request, http::status::not_modified, "", file);
      return;
    }
    send(request, http::status::ok, "", file);
  }

  void send(const WebSession::Request& request, http::status status, const std::string& text,
            const StaticFile* file = nullptr) {
    auto response = std::make_shared<http::response<http::string_body>>(status, request.version());
    set_safety_headers(*response);
    response->set(http::field::content_type, file ? file->type : "text/plain; charset=utf-8");
    if (file != nullptr) {
      response->set(http::field::etag, file->tag);
      response->set(http::field::cache_control, "no-cache");
      response->set(http::field::vary, "Accept-Encoding");
    }
    response->body() = text;
    if (file != nullptr && status == http::status::ok) {
      const bool zip = !file->gzip.empty() && request[http::field::accept_encoding].find("gzip") !=
                                                  beast::string_view::npos;
      if (zip) response->set(http::field::content_encoding, "gzip");
      response->body() = zip ? file->gzip : file->bytes;
    }
    response->keep_alive(request.keep_alive() &&
                         http::to_status_class(status) != http::status_class::client_error);
    response->prepare_payload();
    if (request.method() == http::verb::head) response->body().clear();
    stream_.expires_after(kRequestTime);
    http::async_write(stream_, *response,
                      [self = shared_from_this(), response](error_code error, std::size_t) {
                        if (error) return;
                        if (response->need_eof()) {
                          error_code ignored;
                          self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
                          return;
                        }
                        self->read();
                      });
  }

  Impl& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kLargestHead + kLargestBody};
  std::optional<http::request_parser<http::string_body>> parser_;
};

void Server::Impl::listen() {
  const std::string where = options.address + ", port " + std::to_string(options.port);
  try {
    const tcp::endpoint endpoint(asio::ip::make_address(options.address), options.port);
    acceptor.open(endpoint.protocol());
    acceptor.set_option(asio::socket_base::reuse_address(true));
    acceptor.bind(endpoint);
    acceptor.listen();
  } catch (const boost::system::system_error& error) {
    throw InputError("cannot listen on " + where + ": " + error.code().message());
  }
  accept();
}

void Server::Impl::accept() {
  acceptor.async_accept([this](error_code error, tcp::socket socket) {
    if (error) {
      // For example no file descriptors: others have to go first.
      spdlog::warn("a connection was not accepted: {}", error.message());
      accept_timer.expires_after(std::chrono::seconds(1));
      accept_timer.async_wait([this](error_code) { accept(); });
      return;
    }
    if (connections < kConnectionsBesides) {
      std::make_shared<Connection>(*this, std::move(socket))->read();
    }
    accept();
  });
}

bool Server::Impl::room() {
  sessions.remove_if([](const auto& session) { return session.expired(); });
  return sessions.size() < options.most_clients;
}

std::shared_ptr<WebSession> Server::Impl::session_of(beast::tcp_stream&& stream,
                                                     const std::string& subprotocol) {
  if (subprotocol == PageSession::kSubprotocol) {
    return std::make_shared<PageSession>(std::move(stream), board, source);
  }
  return std::make_shared<FoxgloveSession>(std::move(stream), board, relay, source, subprotocol);
}

void Server::Impl::wake() {
  if (awake.exchange(true)) return;
  asio::post(context, [this] {
    if (timer_set) return;
    timer_set = true;
    timer.expires_after(kPumpPeriod);
    timer.async_wait([this](error_code) { pump_all(); });
  });
}

void Server::Impl::pump_all() {
  timer_set = false;
  awake = false;
  for (auto session = sessions.begin(); session != sessions.end();) {
    if (const auto one = session->lock()) {
      one->pump();
      ++session;
    } else {
      session = sessions.erase(session);
    }
  }
}

Server::Server(const ServerOptions& options, const StaticFiles& files, Board& board,
               const Source* source, Relay& relay)
    : impl_(std::make_unique<Impl>(options, files, board, source, relay)) {}
Server::~Server() = default;

std::uint16_t Server::port() const { return impl_->acceptor.local_endpoint().port(); }

}  // namespace pocd::view

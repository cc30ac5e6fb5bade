#include "pocd_dds/watch/health_socket.hpp"

#include <sys/stat.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "pocd/common/check.hpp"

namespace pocd::dds {
namespace {

namespace asio = boost::asio;
using Local = asio::local::stream_protocol;
using Clock = std::chrono::steady_clock;
using boost::system::error_code;

// A word is a line: what is longer is none.
constexpr std::size_t kMostBytes = 64u << 10;

}  // namespace

struct HealthSocket::Impl {
  explicit Impl(const std::filesystem::path& where) : path(where), acceptor(context) {
    error_code error;
    Local::socket other(context);
    if (!other.connect(Local::endpoint(path.string()), error)) {
      throw InputError(path.string() + ": another process answers on this socket");
    }
    if (std::filesystem::is_socket(path, ignored)) std::filesystem::remove(path, ignored);
    acceptor.open(Local(), error);
    if (!error) acceptor.bind(Local::endpoint(path.string()), error);
    if (!error) acceptor.listen(16, error);
    if (error) throw InputError(path.string() + ": no socket can be made: " + error.message());
    // Connecting takes the right to write; how a node is, is no secret.
    ::chmod(path.c_str(), 0666);
    accept();
    thread = std::thread([this] { context.run(); });
  }
  ~Impl() {
    context.stop();
    thread.join();
    std::filesystem::remove(path, ignored);
  }

  void accept() {
    acceptor.async_accept([this](const error_code& error, Local::socket socket) {
      // Out of file handles, for instance: not at once again.
      if (error) std::this_thread::sleep_for(std::chrono::milliseconds(100));
      if (!error) answer(socket);
      accept();
    });
  }
  void answer(Local::socket& socket) {
    nlohmann::json text;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!word) return;
      text = {{"name", word->name},
              {"line", word->line},
              {"good", word->good},
              {"ready", word->ready},
              {"age_s", std::chrono::duration<double>(Clock::now() - updated).count()}};
    }
    // It fits into the socket's buffer, so a client that does not read holds up nobody.
    error_code error;
    const auto kReplace = nlohmann::json::error_handler_t::replace;
    asio::write(socket, asio::buffer(text.dump(-1, ' ', false, kReplace) + "\n"), error);
  }

  const std::filesystem::path path;
  std::error_code ignored;
  asio::io_context context;
  Local::acceptor acceptor;
  std::mutex mutex;
  std::optional<HealthWord> word;
  Clock::time_point updated{};
  std::thread thread;
};

HealthSocket::HealthSocket(const std::filesystem::path& path) try
    : impl_(std::make_unique<Impl>(path)) {
} catch (const boost::system::system_error& error) {
  throw InputError(path.string() + ": no socket can be made: " + error.what());
}

HealthSocket::~HealthSocket() = default;

void HealthSocket::update(const HealthWord& word) {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  impl_->word = word;
  impl_->updated = Clock::now();
}

std::optional<HealthWord> ask_health(const std::filesystem::path& path, double timeout_s) {
  try {
    asio::io_context context;
    Local::socket socket(context);
    std::string text;
    bool whole = false;
    socket.async_connect(Local::endpoint(path.string()), [&](const error_code& refused) {
      if (refused) return;
      asio::async_read(
          socket, asio::dynamic_buffer(text, kMostBytes),
          [&](const error_code& end, std::size_t) { whole = end == asio::error::eof; });
    });
    context.run_for(
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s)));
    if (!whole) return std::nullopt;
    const nlohmann::json said = nlohmann::json::parse(text);
    return HealthWord{said.at("name"), said.at("line"), said.at("good"), said.at("ready"),
                      said.at("age_s")};
  } catch (const std::exception&) {  // no path of a socket, or no such object
    return std::nullopt;
  }
}

}  // namespace pocd::dds

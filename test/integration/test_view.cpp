// The server of pocd_view on a real socket, with clients that do what they should not.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>

#include "../unit/view/pieces.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/random.hpp"
#include "run_command.hpp"
#include "view/server.hpp"

namespace pocd::view::testing {
namespace {

constexpr int kGenerous_ms = 60000;

/// A TCP connection that does not care for protocols.
class Client {
 public:
  explicit Client(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("no connection");
    }
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool send(const std::string& bytes) {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  /// More of what the server sends into read(). False: it has closed, or nothing came in time.
  bool receive(int time_ms = kGenerous_ms) {
    pollfd ready{socket_, POLLIN, 0};
    if (::poll(&ready, 1, time_ms) <= 0) return false;
    char bytes[65536];
    const ssize_t count = ::recv(socket_, bytes, sizeof bytes, 0);
    if (count > 0) read_.append(bytes, static_cast<std::size_t>(count));
    return count > 0;
  }
  /// What the server has sent until it closed.
  std::string until_closed() {
    while (receive()) {
    }
    return read_;
  }
  std::string& read() { return read_; }

 private:
  int socket_;
  std::string read_;
};

std::string upgrade(std::uint16_t port, const std::string& subprotocol,
                    const std::string& more = "", const std::string& target = "/live") {
  return "GET " + target + " HTTP/1.1\r\nHost: localhost:" + std::to_string(port) +
         "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: " +
         subprotocol + "\r\n" + more + "\r\n";
}

/// A frame of a client; its mask is zero.
std::string frame(const std::string& text, int opcode = 1) {
  std::string out(1, static_cast<char>(0x80 | opcode));
  if (text.size() < 126) {
    out.push_back(static_cast<char>(0x80 | text.size()));
  } else if (text.size() < 65536) {
    out.push_back(static_cast<char>(0xFE));
    out.push_back(static_cast<char>(text.size() >> 8));
    out.push_back(static_cast<char>(text.size()));
  } else {
    out.push_back(static_cast<char>(0xFF));
    for (int i = 7; i >= 0; --i) out.push_back(static_cast<char>(text.size() >> (8 * i)));
  }
  return out + std::string(4, '\0') + text;
}

/// A client of the page's protocol that has been let in.
class Page : public Client {
 public:
  explicit Page(std::uint16_t port, const std::string& subprotocol = "pocd.view.v1")
      : Client(port) {
    send(upgrade(port, subprotocol));
    while (read().find("\r\n\r\n") == std::string::npos && receive()) {
    }
    EXPECT_EQ(read().substr(0, 12), "HTTP/1.1 101");
    read().erase(0, read().find("\r\n\r\n") + 4);
  }
  /// The next binary or text message, "" when none comes in time or the server has ended.
  std::string message(int time_ms = kGenerous_ms) {
    while (true) {
      std::string& bytes = read();
      if (bytes.size() >= 2) {
        const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
        std::size_t head = 2, size = byte(1) & 127;
        if (size == 126) head = 4;
        if (size == 127) head = 10;
        if (bytes.size() >= head) {
          if (head > 2) {
            size = 0;
            for (std::size_t i = 2; i < head; ++i) size = size << 8 | byte(i);
          }
          if (bytes.size() >= head + size) {
            const int opcode = byte(0) & 15;
            const std::string text = bytes.substr(head, size);
            bytes.erase(0, head + size);
            if (opcode == 8) {
              reason = text;
              return "";
            }
            if (opcode == 1 || opcode == 2) return text;
            continue;
          }
        }
      }
      if (!receive(time_ms)) return "";
    }
  }
  /// Why the server ends it, "" when it closed without a word.
  const std::string& until_ended() {
    while (!message().empty()) {
    }
    return reason;
  }
  std::string reason;
  void acknowledge(const std::string& message) {
    std::uint32_t number = 0;
    std::memcpy(&number, message.data(), 4);
    send(frame("{\"ack\":" + std::to_string(number) + "}"));
  }
};

class ViewServer : public ::testing::Test {
 protected:
  void start(ServerOptions options = {}) {
    options.port = 0;
    server = std::make_unique<Server>(options, files(), board, nullptr, relay);
    port = server->port();
  }
  const StaticFiles& files() {
    if (!files_) {
      std::ofstream(folder.path() / "index.html") << "<p>page</p>";
      files_ = std::make_unique<StaticFiles>(folder.path());
    }
    return *files_;
  }
  std::string get(const std::string& request) {
    Client client(port);
    client.send(request);
    return client.until_closed();
  }
  std::string host() const {
    return "Host: localhost:" + std::to_string(port) + "\r\nConnection: close\r\n\r\n";
  }
  /// A well-behaved page sees the newest of what is put on the board.
  void expect_alive(const std::string& word) {
    Page page(port);
    board.put_notice("status", "{\"word\":\"" + word + "\"}");
    for (int i = 0; i < 100; ++i) {
      const std::string message = page.message();
      ASSERT_FALSE(message.empty()) << word;
      page.acknowledge(message);
      for (const ReadPiece& piece : read_message(message)) {
        if (piece.body.find(word) != std::string::npos) return;
      }
    }
    FAIL() << "never saw " << word;
  }

  TemporaryFolder folder;
  std::unique_ptr<StaticFiles> files_;
  Board board;
  Relay relay{dds::BusOptions{}};
  std::unique_ptr<Server> server;
  std::uint16_t port = 0;
};

TEST_F(ViewServer, ServesItsFilesAndNothingElse) {
  start();
  const std::string page = get("GET /?token=x HTTP/1.1\r\n" + host());
  EXPECT_EQ(page.substr(0, 15), "HTTP/1.1 200 OK");
  EXPECT_NE(page.find("<p>page</p>"), std::string::npos);
  EXPECT_NE(page.find("Content-Security-Policy: default-src 'self'"), std::string::npos);
  const std::string head = get("HEAD / HTTP/1.1\r\n" + host());
  EXPECT_EQ(head.substr(0, 15), "HTTP/1.1 200 OK");
  EXPECT_EQ(head.find("<p>"), std::string::npos);
  for (const char* path :
       {"/../../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd", "/index.html/", "/live"}) {
    EXPECT_EQ(get("GET " + std::string(path) + " HTTP/1.1\r\n" + host()).substr(0, 12),
              "HTTP/1.1 404")
        << path;
  }
  EXPECT_EQ(get("POST / HTTP/1.1\r\nContent-Length: 0\r\n" + host()).substr(0, 12), "HTTP/1.1 405");
  EXPECT_EQ(get("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n").substr(0, 12), "HTTP/1.1 403");
}

TEST_F(ViewServer, LetsInOnlyWhomItShould) {
  ServerOptions options;
  options.token = "secret";
  options.most_clients = 2;
  start(options);
  const auto status = [&](const std::string& request) { return get(request).substr(9, 3); };
  EXPECT_EQ(status(upgrade(port, "pocd.view.v1")), "403");
  EXPECT_EQ(status(upgrade(port, "pocd.view.v1", "Origin: http://evil.example\r\n",
                           "/live?token=secret")),
            "403");
  EXPECT_EQ(status(upgrade(port, "chat", "", "/live?token=secret")), "400");
  std::vector<std::unique_ptr<Client>> in;
  for (int i = 0; i < 3; ++i) {
    in.push_back(std::make_unique<Client>(port));
    in.back()->send(
        upgrade(port, i == 0 ? "foxglove.sdk.v1" : "pocd.view.v1", "", "/live?token=secret"));
    ASSERT_TRUE(in.back()->receive());
    EXPECT_EQ(in.back()->read().substr(9, 3), i < 2 ? "101" : "503");
  }
}

TEST_F(ViewServer, WhoDoesNotAcknowledgeGetsTwoMessagesAndThenTheNewest) {
  start();
  Page slow(port);
  for (int i = 0; i < 200; ++i) {
    board.put_notice("status", "{\"n\":" + std::to_string(i) + "}");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const std::string first = slow.message(), second = slow.message();
  ASSERT_FALSE(second.empty());
  EXPECT_EQ(slow.message(500), "");
  slow.acknowledge(second);
  const auto pieces = read_message(slow.message());
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].body.substr(0, 9), "{\"n\":199}");
}

TEST_F(ViewServer, WhatIsNoMessageEndsItsClientOnly) {
  start();
  const std::string wrong[] = {"",
                               "x",
                               "[]",
                               "{}",
                               "{\"ack\":7}",
                               "{\"ack\":-1}",
                               "{\"want\":1}",
                               "{\"want\":[[1,2]]}",
                               "{\"want\":[[1,2,1e99]]}",
                               "{\"want\":[[1,2,99999999]]}",
                               "{\"history\":1}",
                               "{\"at\":\"x\"}",
                               "{\"ack\":0,\"at\":1}",
                               std::string(60000, '['),
                               "{\"want\":" + std::string(50000, '[') + "}",
                               "\xff\xfe"};
  Page bystander(port);
  for (const std::string& text : wrong) {
    Page page(port);
    page.send(frame(text));
    EXPECT_FALSE(page.until_ended().empty()) << text.substr(0, 40);
  }
  {
    Page page(port);
    page.send(frame(std::string(70000, 'x')));  // larger than a message may be
    page.until_ended();
  }
  expect_alive("after_wrong");
  EXPECT_FALSE(bystander.message().empty());
}

TEST_F(ViewServer, AFloodEndsItsClientOnly) {
  start();
  Page flood(port);
  std::string many;
  for (int i = 0; i < 3000; ++i) many += frame("{\"at\":1}");
  flood.send(many);
  EXPECT_NE(flood.until_ended().find("more messages than a client may send"), std::string::npos);
  expect_alive("after_flood");
}

// Random bytes, cut handshakes, and frames with random heads and bodies, on both protocols.
TEST_F(ViewServer, SurvivesWhatIsNoProtocol) {
  start();
  Random random(7);
  const auto noise = [&](std::size_t most) {
    std::string bytes(1 + random.below(most), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random.below(256));
    return bytes;
  };
  const std::string words[] = {"{\"op\":\"subscribe\",\"subscriptions\":",
                               "{\"op\":\"unsubscribe\",\"subscriptionIds\":",
                               "{\"op\":\"getParameters\",\"parameterNames\":",
                               "{\"op\":\"setParameters\",\"parameters\":",
                               "{\"op\":",
                               "{\"want\":",
                               "{\"ack\":",
                               "{\"history\":"};
  const std::string values[] = {"[]}",
                                "[1]}",
                                "[{}]}",
                                "[{\"id\":1,\"channelId\":1}]}",
                                "[{\"id\":-1,\"channelId\":5}]}",
                                "null}",
                                "\"x\"}",
                                "[[0,0,0]]}",
                                "1}",
                                "{}}",
                                "[\"pocd.voxel\"]}"};
  for (int i = 0; i < 300; ++i) {
    Client client(port);
    const std::string handshake = upgrade(port, i % 2 == 0 ? "pocd.view.v1" : "foxglove.sdk.v1");
    const double kind = random.uniform();
    if (kind < 0.15) {
      client.send(noise(3000));
    } else if (kind < 0.3) {
      client.send(handshake.substr(0, random.below(handshake.size())));
    } else {
      client.send(handshake);
      for (int k = 0; k < 8; ++k) {
        if (random.uniform() < 0.3) {
          client.send(noise(200));
        } else if (random.uniform() < 0.3) {
          client.send(frame(noise(200), static_cast<int>(random.below(16))));
        } else {
          client.send(frame(words[random.below(std::size(words))] +
                            values[random.below(std::size(values))]));
        }
      }
      if (random.uniform() < 0.5) client.receive(2);
    }
  }
  expect_alive("after_noise");
}

// One client never reads; what is put on the board meanwhile is far more than any buffer.
TEST_F(ViewServer, AClientThatDoesNotReadHoldsUpNobody) {
  start();
  Page deaf(port, "foxglove.sdk.v1");
  deaf.send(frame("{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1,\"channelId\":1}]}"));
  for (int i = 0; i < 400; ++i) {
    board.put_notice("object/" + std::to_string(i % 20),
                     "{\"text\":\"" + std::string(100000, 'x') + "\"}");
  }
  expect_alive("while_deaf");
}

TEST_F(ViewServer, SaysWhyItCannotListen) {
  start();
  ServerOptions options;
  options.port = port;
  try {
    const Server second(options, files(), board, nullptr, relay);
    FAIL() << "two servers on one port";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("port " + std::to_string(port)), std::string::npos);
  }
}

}  // namespace
}  // namespace pocd::view::testing

// The server of pocd_view on a real socket, with clients that do what they should not.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <cmath>
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
  /// The server has ended it, whatever it has sent before.
  bool closes() {
    while (true) {
      pollfd ready{socket_, POLLIN, 0};
      if (::poll(&ready, 1, kGenerous_ms) <= 0) return false;
      char bytes[4096];
      if (::recv(socket_, bytes, sizeof bytes, 0) <= 0) return true;
    }
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

/// A recording of ten seconds: object "a" is there from the start on and changes every second, "b"
/// from 103.5 s to 107.5 s.
class TenSeconds : public Source {
 public:
  explicit TenSeconds(Board& board) : board_(board) {
    for (int i = 0; i < 10; ++i) {
      board.put_notice(
          "event/" + std::to_string(i),
          "{\"event\":" + std::to_string(i) + ",\"stamp\":" + std::to_string(100 + i) + ".25}");
    }
    read(1.0);
  }
  void read(double share) const {
    board_.put_notice("status", "{\"type\":\"status\",\"time\":[100,110],\"played\":{\"read\":" +
                                    std::to_string(share) + "}}");
  }
  std::optional<std::string> history(const std::string&) const override { return std::nullopt; }
  std::string then(double stamp_s) const override {
    const int second = static_cast<int>(std::floor(stamp_s));
    std::string text = "{\"objects\":[{\"id\":\"a\",\"stamp\":" + std::to_string(second) + "}";
    if (stamp_s >= 103.5 && stamp_s < 107.5) text += ",{\"id\":\"b\",\"stamp\":103.5}";
    return text + "],\"robots\":[]}";
  }

 private:
  Board& board_;
};

class ViewServer : public ::testing::Test {
 protected:
  void start(ServerOptions options = {}, const Source* source = nullptr) {
    options.port = 0;
    server = std::make_unique<Server>(options, files(), board, source, relay);
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
        } else if (random.uniform() < 0.2) {
          client.send(frame('\3' + noise(40), 2));  // as if it asked to play
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

std::string little_endian(std::uint64_t value, int size) {
  std::string out;
  for (int i = 0; i < size; ++i) out.push_back(static_cast<char>(value >> (8 * i)));
  return out;
}

/// A request of playbackControl.
std::string control(bool play, float speed, std::optional<double> seek_s, const std::string& id) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &speed, 4);
  const auto seek_ns = static_cast<std::uint64_t>(seek_s.value_or(0.0) * 1e9);
  return frame(little_endian(3, 1) + little_endian(play ? 0 : 1, 1) + little_endian(bits, 4) +
                   little_endian(seek_s ? 1 : 0, 1) + little_endian(seek_ns, 8) +
                   little_endian(id.size(), 4) + id,
               2);
}

/// A viewer of what is played, with what it has been told.
class Player : public Page {
 public:
  explicit Player(std::uint16_t port, const std::string& subprotocol = "foxglove.sdk.v1")
      : Page(port, subprotocol) {
    send(
        frame("{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1,\"channelId\":1},"
              "{\"id\":2,\"channelId\":2}]}"));
  }
  /// Reads on until it is so. False: the server ended it, or nothing came any more.
  template <class Condition>
  bool until(const Condition& condition, int time_ms = kGenerous_ms) {
    while (!condition()) {
      const std::string one = message(time_ms);
      if (one.empty()) return false;
      const auto number = [&](std::size_t at, int size) {
        std::uint64_t value = 0;
        std::memcpy(&value, one.data() + at, static_cast<std::size_t>(size));
        return value;
      };
      if (one[0] == '{') texts += one;
      if (one[0] == 2) time_s = 1e-9 * static_cast<double>(number(1, 8));
      if (one[0] == 5) {
        states.push_back({static_cast<int>(one[1]), 1e-9 * static_cast<double>(number(2, 8)),
                          one[14] != 0, one.substr(19)});
      }
      if (one[0] == 1) {
        auto& list = number(1, 4) == 1 ? objects : events;
        list.emplace_back(1e-9 * static_cast<double>(number(5, 8)), one.substr(13));
      }
    }
    return true;
  }
  bool answered(const std::string& id) {
    return until([&] { return !states.empty() && states.back().id == id; });
  }
  struct State {
    int status;
    double time_s;
    bool did_seek;
    std::string id;
  };
  std::vector<State> states;
  std::vector<std::pair<double, std::string>> objects, events;
  double time_s = 0.0;
  std::string texts;
};

TEST_F(ViewServer, AViewerPlaysARecording) {
  const TenSeconds source(board);
  start({}, &source);
  Player viewer(port);
  ASSERT_TRUE(viewer.until([&] { return viewer.events.size() == 10; })) << "first, all of it";
  EXPECT_NE(viewer.texts.find("\"playbackControl\""), std::string::npos);
  EXPECT_NE(viewer.texts.find("\"dataStartTime\":{\"nsec\":0,\"sec\":100}"), std::string::npos);
  EXPECT_NE(viewer.texts.find("\"dataEndTime\":{\"nsec\":0,\"sec\":110}"), std::string::npos);
  EXPECT_EQ(viewer.texts.find("\"cdr\""), std::string::npos) << "no topics of a bus beside it";
  EXPECT_EQ(viewer.states.back().status, 3) << "it stands at the end";
  EXPECT_EQ(viewer.states.back().time_s, 110.0);

  // From the start, at five times the speed, to the end.
  viewer.events.clear();
  viewer.send(control(true, 5.0F, 100.0, "from the start"));
  ASSERT_TRUE(viewer.answered("from the start"));
  EXPECT_EQ(viewer.states.back().status, 0);
  EXPECT_EQ(viewer.states.back().time_s, 100.0);
  EXPECT_TRUE(viewer.states.back().did_seek);
  ASSERT_TRUE(viewer.until([&] { return viewer.states.back().status == 3; }));
  EXPECT_EQ(viewer.states.back().time_s, 110.0);
  EXPECT_EQ(viewer.states.back().id, "");
  ASSERT_TRUE(viewer.until([&] { return viewer.events.size() == 10 && viewer.time_s == 110.0; }));
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_NEAR(viewer.events[i].first, 100.25 + static_cast<double>(i), 1e-6);
  }
  ASSERT_TRUE(
      viewer.until([&] { return viewer.objects.back().second.find("110") != std::string::npos; }));
  double last_s = 100.0;
  int came = 0, gone = 0;
  for (const auto& [stamp_s, json] : viewer.objects) {
    EXPECT_GE(stamp_s, last_s);
    last_s = stamp_s;
    if (json.find("\"b\"") == std::string::npos) continue;
    const bool present = json.find("present") != std::string::npos;
    came += present ? 1 : 0;
    gone += json.find("gone") != std::string::npos ? 1 : 0;
    EXPECT_GE(stamp_s, present ? 103.5 : 107.5);
  }
  // On a machine that stands still for a second it may come and go unseen.
  EXPECT_LE(came, 1);
  EXPECT_EQ(gone, came);

  // To a place in the middle, standing: what was there then, and the last event before.
  viewer.objects.clear();
  viewer.events.clear();
  viewer.send(control(false, 1.0F, 105.5, "there"));
  ASSERT_TRUE(viewer.answered("there"));
  EXPECT_EQ(viewer.states.back().status, 1);
  ASSERT_TRUE(
      viewer.until([&] { return viewer.objects.size() == 2 && viewer.events.size() == 1; }));
  EXPECT_NEAR(viewer.events[0].first, 105.25, 1e-6);
  EXPECT_EQ(viewer.time_s, 105.5);
  EXPECT_FALSE(viewer.until([] { return false; }, 300)) << "it stands";
  EXPECT_TRUE(viewer.reason.empty());

  // A speed that is none is answered, and changes nothing.
  viewer.send(control(true, -1.0F, 101.0, "back"));
  ASSERT_TRUE(viewer.answered("back"));
  EXPECT_EQ(viewer.states.back().status, 1);
  EXPECT_EQ(viewer.states.back().time_s, 105.5);
  EXPECT_NE(viewer.texts.find("a speed of playing"), std::string::npos);
}

TEST_F(ViewServer, EachViewerPlaysForItself) {
  const TenSeconds source(board);
  start({}, &source);
  Player one(port), other(port), older(port, "foxglove.websocket.v1");
  one.send(control(false, 1.0F, 102.0, "one"));
  other.send(control(false, 1.0F, 108.0, "other"));
  ASSERT_TRUE(one.until([&] { return one.time_s == 102.0; }));
  ASSERT_TRUE(other.until([&] { return other.time_s == 108.0; }));
  // Who does not know of it gets the end, as it was, and an answer.
  older.send(control(false, 1.0F, 102.0, "older"));
  ASSERT_TRUE(
      older.until([&] { return older.texts.find("nothing to play") != std::string::npos; }));
  ASSERT_TRUE(older.until([&] { return older.events.size() == 10; }));
  EXPECT_EQ(older.texts.find("playbackControl"), std::string::npos);
  EXPECT_TRUE(older.states.empty());
}

TEST_F(ViewServer, OfWhatIsStillReadTheRangeIsNotToldYet) {
  const TenSeconds source(board);
  source.read(0.5);
  start({}, &source);
  Player viewer(port);
  EXPECT_FALSE(viewer.until([&] { return !viewer.texts.empty(); }, 500));
  source.read(1.0);
  EXPECT_TRUE(viewer.until([&] { return viewer.texts.find("dataEndTime") != std::string::npos; }));
}

TEST_F(ViewServer, ADamagedRequestToPlayEndsItsClientOnly) {
  const TenSeconds source(board);
  start({}, &source);
  Player bystander(port);
  const std::string whole = control(true, 1.0F, 101.0, "id").substr(6);
  for (const std::string& damaged :
       {whole.substr(0, 1), whole.substr(0, 18), whole.substr(0, whole.size() - 1),
        whole.substr(0, 1) + '\7' + whole.substr(2),
        whole.substr(0, 15) + std::string(4, '\xff') + "id"}) {
    Player player(port);
    player.send(frame(damaged, 2));
    EXPECT_NE(player.until_ended().find("none of this protocol"), std::string::npos);
  }
  // A flood of seeks, of one that reads nothing, and of one that reads.
  Player deaf(port);
  std::string many;
  for (int i = 0; i < 300; ++i) many += control(true, 1000.0F, 100.0 + i % 10, "many");
  deaf.send(many);
  Player flood(port);
  for (int i = 0; i < 10; ++i) flood.send(many);
  EXPECT_FALSE(flood.until_ended().empty());
  bystander.send(control(false, 1.0F, 104.0, "still here"));
  EXPECT_TRUE(bystander.answered("still here"));
  expect_alive("after_seeks");
}

// What the WebSocket layer answers by itself, or gathers, before a protocol of ours sees it.
TEST_F(ViewServer, PingsAndPiecesOfMessagesEndNobodyElse) {
  start();
  Page pings(port), pieces(port), unmasked(port);
  std::string many;
  for (int i = 0; i < 20000; ++i) many += frame("are you there", 9);
  std::thread flood([&] { pings.send(many); });  // none of the answers is read
  expect_alive("while_pinged");
  // A message in pieces without an end is as large as a message may be at most.
  const std::string body(1000, 'x');
  std::string piece = frame(body);
  piece[0] = 1;  // more follows
  pieces.send(piece);
  piece[0] = 0;
  for (int i = 0; i < 200; ++i) {
    if (!pieces.send(piece)) break;
  }
  EXPECT_TRUE(pieces.closes());
  std::string bare = frame("{\"ack\":0}");
  bare[1] = static_cast<char>(bare[1] & 0x7F);
  bare.erase(2, 4);
  unmasked.send(bare);
  EXPECT_TRUE(unmasked.closes());
  expect_alive("after_pings");
  server.reset();
  flood.join();
}

// Connections that say nothing are let go, and until then others have room.
TEST_F(ViewServer, WhoSaysNothingIsLetGo) {
  start();
  std::vector<std::unique_ptr<Client>> idle;
  for (int i = 0; i < 60; ++i) {
    idle.push_back(std::make_unique<Client>(port));
    idle.back()->send(i % 2 == 0 ? "" : "GET / HTTP/1.1\r\nHost: local");
  }
  expect_alive("beside_the_idle");
  EXPECT_EQ(get("GET / HTTP/1.1\r\n" + host()).substr(0, 15), "HTTP/1.1 200 OK");
  for (const auto& one : idle) EXPECT_TRUE(one->closes());
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

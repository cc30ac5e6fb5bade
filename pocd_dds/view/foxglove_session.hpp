// A viewer that speaks the Foxglove WebSocket protocol, version 1
// (github.com/foxglove/ws-protocol).
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "view/board.hpp"
#include "view/json_text.hpp"
#include "view/relay.hpp"
#include "view/web_session.hpp"

namespace pocd::view {

/// Subprotocols foxglove.websocket.v1 and foxglove.sdk.v1, which differ in their names only as far
/// as they are used here. Channels: objects, events, health and status in JSON with a schema, and
/// the topics of the relay in CDR with their ROS 2 definitions. Time is that of the data.
/// Parameters say what the map is and cannot be set. A viewer that is slow gets the newest state of
/// each object, and misses older samples of the topics, of which it is told.
class FoxgloveSession : public WebSession {
 public:
  static constexpr const char* kSubprotocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};
  static constexpr std::size_t kMostSubscriptions = 256;
  static constexpr std::size_t kMostTexts = 64;  ///< answers not sent yet; more end the client

  FoxgloveSession(boost::beast::tcp_stream&& stream, const Board& board, Relay& relay)
      : WebSession(std::move(stream)), board_(board), relay_(relay) {}
  ~FoxgloveSession() override;

 protected:
  void opened() override;
  std::string received(const std::string& message, bool binary) override;
  std::optional<Outgoing> next() override;

 private:
  struct Subscription {
    std::uint64_t channel = 0;
    std::uint64_t read = 0;  ///< revision of the board, or number of the relay
  };
  std::string subscribe(const Json& message);
  std::string unsubscribe(const Json& message);
  Json parameters(const Json& message) const;
  void say(const Json& json) { texts_.push_back(text_of(json)); }
  void status(int level, const std::string& text);
  std::optional<Outgoing> next_of(std::uint32_t id, Subscription& subscription);
  std::optional<Outgoing> next_time();
  double data_time() const;

  const Board& board_;
  Relay& relay_;
  std::deque<std::string> texts_;
  std::map<std::uint32_t, Subscription> subscriptions_;
  std::uint32_t served_ = 0;  // the subscription that was served last: they take turns
  double told_time_ = -1.0;
  bool told_missed_ = false;
};

}  // namespace pocd::view

// A viewer that speaks the Foxglove WebSocket protocol, version 1
// (github.com/foxglove/ws-protocol; what is played: github.com/foxglove/foxglove-sdk).
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "view/board.hpp"
#include "view/json_text.hpp"
#include "view/newest_log.hpp"
#include "view/playback.hpp"
#include "view/relay.hpp"
#include "view/source.hpp"
#include "view/web_session.hpp"

namespace pocd::view {

/// Channels: objects, events, health and status in JSON with a schema, and of a bus the topics of
/// the relay in CDR with their ROS 2 definitions. Time is that of the data. Parameters say what the
/// map is and cannot be set. A viewer that is slow gets the newest state of each object, and misses
/// older samples of the topics, of which it is told. The subprotocol foxglove.sdk.v1 has
/// playbackControl where a recording or a memory is shown: each viewer plays for itself, objects
/// and events are those of its time; until it asks for the first time, those of the end.
class FoxgloveSession : public WebSession {
 public:
  static constexpr const char* kPlaying = "foxglove.sdk.v1";  ///< knows playbackControl
  static constexpr std::size_t kMostSubscriptions = 256;
  static constexpr std::size_t kMostAnswers = 64;  ///< not sent yet; more end the client

  FoxgloveSession(boost::beast::tcp_stream&& stream, const Board& board, Relay& relay,
                  const Source* source, const std::string& subprotocol)
      : WebSession(std::move(stream)),
        board_(board),
        relay_(relay),
        source_(source),
        knows_playback_(subprotocol == kPlaying) {}
  ~FoxgloveSession() override;

 protected:
  std::string received(const std::string& message, bool binary) override;
  std::optional<Outgoing> next() override;
  bool busy() const override;

 private:
  struct Subscription {
    std::uint64_t channel = 0;
    std::uint64_t read = 0;  ///< revision of the board, or number of the relay
  };
  bool greet();
  std::string subscribe(const Json& message);
  std::string unsubscribe(const Json& message);
  Json parameters(const Json& message) const;
  void say(const Json& json) { answers_.push_back({text_of(json), false}); }
  void say(const PlaybackState& state) { answers_.push_back({message_of(state), true}); }
  void status(int level, const std::string& text);
  std::string control(const std::string& message);
  void play_on();
  void show_objects(StampNs stamp_ns);
  void show_events(StampNs stamp_ns, bool sought);
  std::optional<Outgoing> next_of(std::uint32_t id, Subscription& subscription);
  std::optional<Outgoing> next_time();
  StampNs data_time() const;

  const Board& board_;
  Relay& relay_;
  const Source* source_;
  const bool knows_playback_;
  bool greeted_ = false;
  bool played_ = false;  // a recording or a memory, not a bus
  std::deque<Outgoing> answers_;
  std::map<std::uint32_t, Subscription> subscriptions_;
  std::uint32_t served_ = 0;  // the subscription that was served last: they take turns
  StampNs told_ns_ = -1;
  bool told_missed_ = false;

  // Where something is played: the time of this viewer, and what it is shown of it.
  struct Shown {
    StampNs stamp_ns = 0;
    std::string json;
  };
  std::optional<PlaybackClock> clock_;
  bool controlled_ = false, sought_ = false, told_end_ = true;
  std::optional<StampNs> shown_ns_;
  PlaybackClock::Wall next_look_{};
  NewestLog<std::string, Shown> shown_;                // by key, as on the board
  std::map<std::string, std::string> there_;           // objects that it was shown, by key
  std::vector<std::pair<StampNs, std::string>> past_;  // events by stamp: their keys on the board
};

}  // namespace pocd::view

// A client that shows the page: subprotocol pocd.view.v1.
#pragma once

#include <deque>
#include <vector>

#include "view/board.hpp"
#include "view/source.hpp"
#include "view/web_session.hpp"

namespace pocd::view {

/// The messages of the server are those of message_of(); the client answers each with its number,
/// {"ack": 7}, when it has used it, and no more than kMostUnderWay are under way. So a page that is
/// slow, or in the background, gets the newest state at its own pace. It may also send {"want":
/// [[x, y, z], ...]}, the chunks that it wants finely, nearest first; {"history": uuid}; {"at":
/// stamp}: from then on it gets the map as it was at that stamp, and an answer with the objects;
/// {"at": null}: of now again.
class PageSession : public WebSession {
 public:
  static constexpr const char* kSubprotocol = "pocd.view.v1";
  static constexpr std::uint32_t kMostUnderWay = 2;
  static constexpr std::size_t kBatch = 192 * 1024;  ///< bytes of a message, about
  static constexpr std::size_t kMostWanted = 4096;   ///< chunks
  static constexpr std::size_t kMostAnswers = 16;    ///< not sent yet; the oldest make room

  PageSession(boost::beast::tcp_stream&& stream, const Board& board, const Source* source)
      : WebSession(std::move(stream)), board_(board), source_(source) {}

 protected:
  std::string received(const std::string& message, bool binary) override;
  std::optional<Outgoing> next() override;

 private:
  void answer(const std::string& json);

  const Board& board_;
  const Source* source_;
  Reading reading_;
  std::vector<ChunkKey> wanted_;
  std::deque<Piece> answers_;
  std::uint32_t sent_ = 0, acknowledged_ = 0;
};

}  // namespace pocd::view

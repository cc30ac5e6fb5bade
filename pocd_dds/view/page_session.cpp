#include "view/page_session.hpp"

#include <algorithm>
#include <set>

#include "view/json_text.hpp"

namespace pocd::view {
namespace {

constexpr char kNoMessage[] = "a message that is none of this protocol";

bool whole(const Json& json) { return json.is_number_integer(); }

std::optional<ChunkKey> chunk_from(const Json& json) {
  if (!json.is_array() || json.size() != 3) return std::nullopt;
  std::int32_t at[3];
  for (int i = 0; i < 3; ++i) {
    if (!whole(json[i])) return std::nullopt;
    const auto value = json[i].get<std::int64_t>();
    if (value < -1000000 || value > 1000000) return std::nullopt;
    at[i] = static_cast<std::int32_t>(value);
  }
  return ChunkKey{at[0], at[1], at[2]};
}

}  // namespace

std::string PageSession::received(const std::string& message, bool binary) {
  const Json json = binary ? Json(Json::value_t::discarded) : Json::parse(message, nullptr, false);
  if (!json.is_object() || json.size() != 1) return kNoMessage;
  const std::string& name = json.begin().key();
  const Json& value = json.begin().value();
  if (name == "ack" && value.is_number_unsigned()) {
    const auto number = value.get<std::uint64_t>();
    if (number > sent_ || number < acknowledged_) return "an acknowledgement of what was not sent";
    acknowledged_ = static_cast<std::uint32_t>(number);
    return "";
  }
  if (name == "want" && value.is_array() && value.size() <= kMostWanted) {
    std::vector<ChunkKey> wanted;
    for (const Json& item : value) {
      const auto chunk = chunk_from(item);
      if (!chunk) return kNoMessage;
      wanted.push_back(*chunk);
    }
    // What is not wanted any more is forgotten by the page, too.
    const std::set<ChunkKey> kept(wanted.begin(), wanted.end());
    reading_.keep_tiles_of(kept);
    wanted_ = std::move(wanted);
    return "";
  }
  if (name == "history" && value.is_string()) {
    const std::string uuid = value.get<std::string>();
    const auto history = source_ != nullptr ? source_->history(uuid) : std::nullopt;
    answer(
        history.value_or(text_of({{"type", "history"}, {"id", uuid}, {"samples", Json::array()}})));
    return "";
  }
  if (name == "at" && value.is_null()) {
    board_.show_at(reading_, std::nullopt);
    return "";
  }
  if (name == "at" && value.is_number()) {
    board_.show_at(reading_, stamp_from(value.get<double>()));
    if (source_ != nullptr) answer(source_->then(value.get<double>()));
    return "";
  }
  return kNoMessage;
}

void PageSession::answer(const std::string& json) {
  answers_.push_back(json_piece(json));
  if (answers_.size() > kMostAnswers) answers_.pop_front();
}

std::optional<WebSession::Outgoing> PageSession::next() {
  if (sent_ - acknowledged_ >= kMostUnderWay) return std::nullopt;
  bool reset = false;
  std::vector<Piece> pieces = board_.next(reading_, wanted_, kBatch, reset);
  if (reset) pieces.insert(pieces.begin(), json_piece(R"({"type":"reset"})"));
  pieces.insert(pieces.begin() + (reset ? 1 : 0), answers_.begin(), answers_.end());
  answers_.clear();
  if (pieces.empty()) return std::nullopt;
  return Outgoing{message_of(++sent_, pieces), true};
}

}  // namespace pocd::view

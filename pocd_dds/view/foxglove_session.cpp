#include "view/foxglove_session.hpp"

#include <algorithm>
#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd::view {
namespace {

constexpr char kNoMessage[] = "a message that is none of this protocol";
constexpr std::chrono::milliseconds kLookPeriod{100};  // of what is played
constexpr int kRest = 10;  // times as long as a look took: it is the thread of all clients

/// A channel in JSON: notices of the board whose key begins with the prefix.
struct JsonChannel {
  const char *topic, *prefix, *schema_name, *properties;
};
constexpr char kObject[] =
    R"("id":{"type":"string"},"number":{"type":"integer"},"class":{"type":"string"},"static":{"type":"boolean"},"box":{"type":"array","items":{"type":"number"}},"belief":{"type":"object","properties":{"v":{"type":"number"},"mu":{"type":"number"},"sigma":{"type":"number"},"alpha":{"type":"number"},"beta":{"type":"number"}}},"first_seen":{"type":"number"},"last_seen":{"type":"number"},"observations":{"type":"integer"},"robot":{"type":"string"},"condition":{"type":"string"})";
constexpr char kEvent[] =
    R"("event":{"type":"integer"},"kind":{"type":"string"},"id":{"type":"string"},"number":{"type":"integer"},"class":{"type":"string"},"stamp":{"type":"number"},"robot":{"type":"string"},"box":{"type":"array","items":{"type":"number"}},"previous":{"type":"array","items":{"type":"number"}},"evidence":{"type":"object"})";
constexpr char kHealth[] =
    R"("name":{"type":"string"},"level":{"type":"integer"},"message":{"type":"string"},"condition":{"type":"string"},"frames_processed":{"type":"integer"},"robots":{"type":"array","items":{"type":"object"}})";
constexpr char kStatus[] =
    R"("in_step":{"type":"boolean"},"stale_because":{"type":"string"},"version":{"type":"integer"},"tiles":{"type":"integer"},"objects":{"type":"integer"})";
constexpr JsonChannel kJsonChannels[] = {
    {"/pocd/objects", "object/", "pocd.Object", kObject},
    {"/pocd/object_events", "event/", "pocd.ObjectEvent", kEvent},
    {"/pocd/health", "health/", "pocd.Health", kHealth},
    {"/pocd/status", "status", "pocd.Status", kStatus},
};
constexpr std::uint64_t kJsonCount = std::size(kJsonChannels);

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<char>(value >> (8 * i)));
}

/// As the protocol has it: never negative.
std::uint64_t unsigned_ns(StampNs stamp_ns) {
  return static_cast<std::uint64_t>(std::max<StampNs>(stamp_ns, 0));
}

/// The stamp of what a notice says, where it has one.
StampNs stamp_of(const std::string& notice, StampNs otherwise) {
  const Json json = Json::parse(notice, nullptr, false);
  for (const char* field : {"stamp", "last_seen"}) {
    if (json.is_object() && json.contains(field)) return stamp_from(json[field].get<double>());
  }
  return otherwise;
}

std::optional<std::uint32_t> id_from(const Json& json) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > 0xFFFFFFFFu) return std::nullopt;
  return static_cast<std::uint32_t>(json.get<std::uint64_t>());
}

/// As the protocol has it in texts, whose numbers are doubles.
Json time_json(StampNs stamp_ns) {
  const std::uint64_t ns = unsigned_ns(stamp_ns);
  return {{"sec", ns / 1000000000}, {"nsec", ns % 1000000000}};
}

Json channels(const Relay* relay) {
  Json list = Json::array();
  for (std::uint64_t i = 0; i < kJsonCount; ++i) {
    const JsonChannel& channel = kJsonChannels[i];
    list.push_back({{"id", i + 1},
                    {"topic", channel.topic},
                    {"encoding", "json"},
                    {"schemaName", channel.schema_name},
                    {"schemaEncoding", "jsonschema"},
                    {"schema", std::string(R"({"type":"object","properties":{)") +
                                   channel.properties + "}}"}});
  }
  for (std::size_t i = 0; relay != nullptr && i < relay->topics().size(); ++i) {
    const RelayedTopic& topic = relay->topics()[i];
    list.push_back({{"id", kJsonCount + i + 1},
                    {"topic", dds::recorded_name(topic.topic.name)},
                    {"encoding", "cdr"},
                    {"schemaName", topic.schema.name},
                    {"schemaEncoding", topic.schema.encoding},
                    {"schema", topic.schema.text}});
  }
  return list;
}

}  // namespace

FoxgloveSession::~FoxgloveSession() {
  for (const auto& [id, subscription] : subscriptions_) {
    if (subscription.channel > kJsonCount) relay_.unwant(subscription.channel - kJsonCount - 1);
  }
}

/// Of what is played the range has to be known first: it is read when this is true.
bool FoxgloveSession::greet() {
  const Json state = Json::parse(board_.notice("status"), nullptr, false);
  played_ = state.is_object() && state.contains("played");
  if (played_ && state["played"]["read"].get<double>() < 1.0) return false;
  greeted_ = true;
  Json info = {{"op", "serverInfo"},
               {"name", "pocd_view"},
               {"capabilities", {"time", "parameters"}},
               {"supportedEncodings", Json::array()},
               {"metadata", {{"program", "pocd_view"}}},
               {"sessionId", state.is_object() ? state.value("epoch", "") : ""}};
  if (played_ && knows_playback_ && source_ != nullptr && state.contains("time")) {
    clock_.emplace(stamp_from(state["time"][0].get<double>()),
                   stamp_from(state["time"][1].get<double>()));
    info["capabilities"].push_back("playbackControl");
    info["dataStartTime"] = time_json(clock_->first_ns());
    info["dataEndTime"] = time_json(clock_->last_ns());
  }
  say(info);
  say({{"op", "advertise"}, {"channels", channels(played_ ? nullptr : &relay_)}});
  if (clock_) say(clock_->state(std::chrono::steady_clock::now()));
  return true;
}

void FoxgloveSession::status(int level, const std::string& text) {
  say({{"op", "status"}, {"level", level}, {"message", text}});
}

std::string FoxgloveSession::received(const std::string& message, bool binary) {
  if (answers_.size() >= kMostAnswers) return "questions whose answers are not read";
  if (binary) {
    if (!message.empty() && message[0] == kPlaybackRequestOpcode) return control(message);
    status(2, "clients cannot publish");
    return "";
  }
  const Json json = Json::parse(message, nullptr, false);
  if (!json.is_object() || !json.contains("op") || !json["op"].is_string()) return kNoMessage;
  const std::string op = json["op"].get<std::string>();
  if (op == "subscribe") return subscribe(json);
  if (op == "unsubscribe") return unsubscribe(json);
  if (op == "getParameters" || op == "setParameters") {
    if (op == "setParameters") status(1, "parameters cannot be set");
    Json answer = {{"op", "parameterValues"}, {"parameters", parameters(json)}};
    if (json.contains("id") && json["id"].is_string()) answer["id"] = json["id"];
    say(answer);
    return "";
  }
  // Part of the protocol, for capabilities that were not offered.
  status(1, "not supported: " + op.substr(0, 40));
  return "";
}

std::string FoxgloveSession::subscribe(const Json& message) {
  if (!message.contains("subscriptions") || !message["subscriptions"].is_array()) return kNoMessage;
  for (const Json& wish : message["subscriptions"]) {
    if (!wish.is_object() || !wish.contains("id") || !wish.contains("channelId")) return kNoMessage;
    const auto id = id_from(wish["id"]), channel = id_from(wish["channelId"]);
    if (!id || !channel) return kNoMessage;
    if (*channel == 0 || *channel > kJsonCount + (played_ ? 0 : relay_.topics().size())) {
      status(2, "there is no channel " + std::to_string(*channel));
      continue;
    }
    if (subscriptions_.count(*id) > 0) {
      status(2, "subscription " + std::to_string(*id) + " is there already");
      continue;
    }
    if (subscriptions_.size() >= kMostSubscriptions)
      return "more subscriptions than a client may have";
    Subscription subscription;
    subscription.channel = *channel;
    if (*channel > kJsonCount) {
      const std::size_t index = *channel - kJsonCount - 1;
      try {
        relay_.want(index);
      } catch (const InputError& error) {
        status(2, error.what());
        continue;
      }
      subscription.read = relay_.begin(index);
    }
    subscriptions_[*id] = std::move(subscription);
  }
  return "";
}

std::string FoxgloveSession::unsubscribe(const Json& message) {
  if (!message.contains("subscriptionIds") || !message["subscriptionIds"].is_array()) {
    return kNoMessage;
  }
  for (const Json& item : message["subscriptionIds"]) {
    const auto id = id_from(item);
    if (!id) return kNoMessage;
    const auto known = subscriptions_.find(*id);
    if (known == subscriptions_.end()) continue;
    if (known->second.channel > kJsonCount) relay_.unwant(known->second.channel - kJsonCount - 1);
    subscriptions_.erase(known);
  }
  return "";
}

Json FoxgloveSession::parameters(const Json& message) const {
  const Json state = Json::parse(board_.notice("status"), nullptr, false);
  Json values = Json::array();
  if (!state.is_object()) return values;
  const Json names = message.contains("parameterNames") ? message["parameterNames"] : Json::array();
  for (const char* field :
       {"voxel", "epoch", "version", "in_step", "stale_because", "tiles", "objects", "ended"}) {
    const std::string name = std::string("pocd.") + field;
    bool wanted = !names.is_array() || names.empty();
    if (!wanted) {
      for (const Json& one : names) wanted = wanted || one == name;
    }
    if (wanted && state.contains(field)) {
      values.push_back({{"name", name}, {"value", state[field]}});
    }
  }
  return values;
}

bool FoxgloveSession::busy() const { return clock_ && (clock_->playing() || sought_); }

std::string FoxgloveSession::control(const std::string& message) {
  const auto request = playback_request_from(message);
  if (!request) return kNoMessage;
  if (!clock_) {
    status(2, "there is nothing to play");
    return "";
  }
  PlaybackState state;
  if (!clock_->apply(*request, std::chrono::steady_clock::now(), state)) {
    status(2, "a speed of playing has to be above 0, up to 1000");
  } else {
    sought_ = sought_ || state.did_seek || !controlled_;
    controlled_ = true;
    told_end_ = state.status == PlaybackStatus::kEnded;
  }
  say(state);
  return "";
}

/// Brings what the viewer is shown to its time.
void FoxgloveSession::play_on() {
  if (!controlled_) return;
  const auto start = std::chrono::steady_clock::now();
  const PlaybackState state = clock_->state(start);
  const bool ended = state.status == PlaybackStatus::kEnded;
  if (ended && !told_end_) say(state);
  told_end_ = ended;
  if (start < next_look_ && !(ended && !sought_)) return;
  if (!sought_ && state.time_ns == shown_ns_) return;
  if (sought_) {
    shown_ = {};
    for (auto& [id, subscription] : subscriptions_) subscription.read = 0;
  }
  show_objects(state.time_ns);
  show_events(state.time_ns, sought_);
  shown_ns_ = state.time_ns;
  sought_ = false;
  const auto took = std::chrono::steady_clock::now() - start;
  next_look_ = start + std::max<std::chrono::steady_clock::duration>(kLookPeriod, kRest * took);
}

void FoxgloveSession::show_objects(StampNs stamp_ns) {
  const Json then = Json::parse(source_->then(seconds(stamp_ns)), nullptr, false);
  std::map<std::string, std::string> now;
  for (const Json& one : then.at("objects")) {
    Json object = one;
    object["type"] = "object";
    object["condition"] = "present";
    object["last_seen"] = one.at("stamp");
    now["object/" + one.at("id").get<std::string>()] = text_of(object);
  }
  for (const auto& [key, json] : there_) {
    if (now.count(key) > 0) continue;
    Json object = Json::parse(json);
    object["condition"] = "gone";
    shown_.put(key, {stamp_ns, text_of(object)});
  }
  for (const auto& [key, json] : now) {
    const auto before = there_.find(key);
    if (sought_ || before == there_.end() || before->second != json) {
      shown_.put(key, {stamp_ns, json});
    }
  }
  there_ = std::move(now);
}

/// Those between the time shown before and this one; after a seek the last one before.
void FoxgloveSession::show_events(StampNs stamp_ns, bool sought) {
  if (past_.empty()) {
    std::uint64_t read = 0;
    for (const auto& [key, json] : board_.notices_after(read, "event/", ~std::size_t{0})) {
      past_.emplace_back(stamp_of(json, 0), key);
    }
    std::stable_sort(past_.begin(), past_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
  }
  const auto after = [&](StampNs stamp) {
    return std::upper_bound(past_.begin(), past_.end(), stamp,
                            [](StampNs s, const auto& event) { return s < event.first; });
  };
  const auto end = after(stamp_ns);
  auto from = sought ? (end == past_.begin() ? end : std::prev(end)) : after(*shown_ns_);
  for (; from < end; ++from) shown_.put(from->second, {from->first, board_.notice(from->second)});
}

StampNs FoxgloveSession::data_time() const {
  if (shown_ns_) return *shown_ns_;
  const Json state = Json::parse(board_.notice("status"), nullptr, false);
  if (!state.is_object() || !state.contains("time")) return 0;
  return stamp_from(state["time"][1].get<double>());
}

std::optional<WebSession::Outgoing> FoxgloveSession::next_time() {
  const StampNs now_ns = data_time();
  if (now_ns == told_ns_) return std::nullopt;
  told_ns_ = now_ns;
  Outgoing out{std::string(1, '\x02'), true};
  put(out.data, unsigned_ns(now_ns), 8);
  return out;
}

std::optional<WebSession::Outgoing> FoxgloveSession::next() {
  if (!greeted_ && !greet()) return std::nullopt;
  play_on();
  if (!answers_.empty()) {
    Outgoing out = std::move(answers_.front());
    answers_.pop_front();
    return out;
  }
  if (auto time = next_time()) return time;
  // From the one after the last on, once round.
  auto turn = subscriptions_.upper_bound(served_);
  for (std::size_t i = 0; i < subscriptions_.size(); ++i, ++turn) {
    if (turn == subscriptions_.end()) turn = subscriptions_.begin();
    if (auto out = next_of(turn->first, turn->second)) {
      served_ = turn->first;
      return out;
    }
  }
  return std::nullopt;
}

std::optional<WebSession::Outgoing> FoxgloveSession::next_of(std::uint32_t id,
                                                             Subscription& subscription) {
  Outgoing out{std::string(1, '\x01'), true};
  put(out.data, id, 4);
  if (subscription.channel > kJsonCount) {
    const std::size_t index = subscription.channel - kJsonCount - 1;
    const RelayedSample sample = relay_.after(index, subscription.read);
    if (sample.number == 0) return std::nullopt;
    if (sample.number > subscription.read + 1 && !told_missed_) {
      told_missed_ = true;
      status(1, "too slow for " + relay_.topics()[index].topic.name + ": samples were left out");
    }
    subscription.read = sample.number;
    put(out.data, unsigned_ns(told_ns_), 8);
    out.data.append(reinterpret_cast<const char*>(sample.payload->data()), sample.payload->size());
    return out;
  }
  const std::string prefix = kJsonChannels[subscription.channel - 1].prefix;
  if (controlled_ && (prefix == "object/" || prefix == "event/")) {
    while (true) {
      const auto [key, entry] = shown_.after(subscription.read);
      if (entry == nullptr) return std::nullopt;
      subscription.read = entry->revision;
      if (key->compare(0, prefix.size(), prefix) != 0) continue;
      put(out.data, unsigned_ns(entry->value.stamp_ns), 8);
      out.data += entry->value.json;
      return out;
    }
  }
  // One at a time is taken, so that what follows is the newest when it is its turn.
  const auto found = board_.notices_after(subscription.read, prefix, 1);
  if (found.empty()) return std::nullopt;
  put(out.data, unsigned_ns(stamp_of(found.front().second, told_ns_)), 8);
  out.data += found.front().second;
  return out;
}

}  // namespace pocd::view

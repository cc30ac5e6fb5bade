#include "view/foxglove_session.hpp"

#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd::view {
namespace {

constexpr char kNoMessage[] = "a message that is none of this protocol";

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

std::uint64_t nanoseconds(double stamp_s) {
  return stamp_s > 0.0 ? static_cast<std::uint64_t>(std::llround(stamp_s * 1e9)) : 0;
}

/// The stamp of what a notice says, where it has one.
double stamp_of(const std::string& notice, double otherwise) {
  const Json json = Json::parse(notice, nullptr, false);
  for (const char* field : {"stamp", "last_seen"}) {
    if (json.is_object() && json.contains(field)) return json[field].get<double>();
  }
  return otherwise;
}

std::optional<std::uint32_t> id_from(const Json& json) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > 0xFFFFFFFFu) return std::nullopt;
  return static_cast<std::uint32_t>(json.get<std::uint64_t>());
}

Json channels(const Relay& relay) {
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
  for (std::size_t i = 0; i < relay.topics().size(); ++i) {
    const RelayedTopic& topic = relay.topics()[i];
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

void FoxgloveSession::opened() {
  const Json state = Json::parse(board_.notice("status"), nullptr, false);
  say({{"op", "serverInfo"},
       {"name", "pocd_view"},
       {"capabilities", {"time", "parameters"}},
       {"supportedEncodings", Json::array()},
       {"metadata", {{"program", "pocd_view"}}},
       {"sessionId", state.is_object() ? state.value("epoch", "") : ""}});
  say({{"op", "advertise"}, {"channels", channels(relay_)}});
}

void FoxgloveSession::status(int level, const std::string& text) {
  say({{"op", "status"}, {"level", level}, {"message", text}});
}

std::string FoxgloveSession::received(const std::string& message, bool binary) {
  if (texts_.size() >= kMostTexts) return "questions whose answers are not read";
  if (binary) {
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
    if (*channel == 0 || *channel > kJsonCount + relay_.topics().size()) {
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

double FoxgloveSession::data_time() const {
  const Json state = Json::parse(board_.notice("status"), nullptr, false);
  if (!state.is_object() || !state.contains("time")) return 0.0;
  return state["time"][1].get<double>();
}

std::optional<WebSession::Outgoing> FoxgloveSession::next_time() {
  const double now_s = data_time();
  if (now_s == told_time_) return std::nullopt;
  told_time_ = now_s;
  Outgoing out{std::string(1, '\x02'), true};
  put(out.data, nanoseconds(now_s), 8);
  return out;
}

std::optional<WebSession::Outgoing> FoxgloveSession::next() {
  if (!texts_.empty()) {
    Outgoing out{std::move(texts_.front()), false};
    texts_.pop_front();
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
    put(out.data, nanoseconds(told_time_), 8);
    out.data.append(reinterpret_cast<const char*>(sample.payload->data()), sample.payload->size());
    return out;
  }
  const std::string prefix = kJsonChannels[subscription.channel - 1].prefix;
  // One at a time is taken, so that what follows is the newest when it is its turn.
  const auto found = board_.notices_after(subscription.read, prefix, 1);
  if (found.empty()) return std::nullopt;
  put(out.data, nanoseconds(stamp_of(found.front().second, told_time_)), 8);
  out.data += found.front().second;
  return out;
}

}  // namespace pocd::view

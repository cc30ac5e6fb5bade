#include "pocd/track/rules.hpp"

#include "pocd/common/check.hpp"

namespace pocd {

const std::vector<RuleInfo>& all_rules() {
  constexpr EventKind kAdded = EventKind::kAdded, kUpdated = EventKind::kUpdated,
                      kMoved = EventKind::kMoved, kRemoved = EventKind::kRemoved;
  static const std::vector<RuleInfo> rules = {
      {Rule::kUnknown, "unknown", {kAdded}},
      {Rule::kFound, "found", {kAdded}},
      {Rule::kArrived, "arrived", {kAdded}},
      {Rule::kGrew, "grew", {kUpdated}},
      {Rule::kPartRemoved, "part_removed", {kUpdated}},
      {Rule::kJoined, "joined", {kUpdated}},
      {Rule::kStationarityBelowThreshold, "stationarity_below_threshold", {kRemoved, kMoved}},
      {Rule::kNothingLeft, "nothing_left", {kRemoved, kMoved}},
      {Rule::kPartSeenThrough, "part_seen_through", {kRemoved, kMoved}},
      {Rule::kAnotherThing, "another_thing", {kRemoved}},
      {Rule::kFoundAgain, "found_again", {kMoved}},
      {Rule::kMovedAlike, "moved_alike", {kMoved}},
      {Rule::kAlignedElsewhere, "aligned_elsewhere", {kMoved}},
      {Rule::kCandidateSeenThrough, "candidate_seen_through", {}},
      {Rule::kNeverConfirmed, "never_confirmed", {}},
      {Rule::kCandidateLapsed, "candidate_lapsed", {}},
  };
  return rules;
}

std::string rule_text(Rule rule, ObjectId other) {
  const RuleInfo& info = all_rules().at(static_cast<std::size_t>(rule));
  POCD_CHECK(info.rule == rule);
  POCD_CHECK((rule == Rule::kJoined) == (other != ObjectId::kNone));
  if (rule != Rule::kJoined) return info.name;
  return std::string(info.name) + "_" + std::to_string(to_index(other));
}

std::optional<Rule> rule_of(const std::string& text) {
  for (const RuleInfo& info : all_rules()) {
    const std::string name = info.name;
    if (info.rule != Rule::kJoined) {
      if (text == name) return info.rule;
      continue;
    }
    const std::string number =
        text.rfind(name + "_", 0) == 0 ? text.substr(name.size() + 1) : std::string();
    if (!number.empty() && number.find_first_not_of("0123456789") == std::string::npos)
      return info.rule;
  }
  return std::nullopt;
}

Rule added_rule(Arrival arrival) {
  switch (arrival) {
    case Arrival::kUnknown:
      return Rule::kUnknown;
    case Arrival::kFound:
      return Rule::kFound;
    case Arrival::kArrived:
      return Rule::kArrived;
  }
  return Rule::kUnknown;
}

}  // namespace pocd

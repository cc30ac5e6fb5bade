// Why things happen to objects: the rules of their life, as events name them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pocd/objects/frame_result.hpp"

namespace pocd {

/// docs/method.md says of each when it holds, by which threshold, and what tests it.
enum class Rule : std::uint8_t {
  // ADDED: confirmed, with its Arrival.
  kUnknown,
  kFound,
  kArrived,
  // UPDATED.
  kGrew,
  kPartRemoved,
  kJoined,  ///< with the other object's number: "joined_12"
  // REMOVED; or MOVED, when what departed is found at once.
  kStationarityBelowThreshold,
  kNothingLeft,
  kPartSeenThrough,
  // REMOVED, after a MOVED.
  kAnotherThing,
  // MOVED.
  kFoundAgain,
  kMovedAlike,
  kAlignedElsewhere,
  // Candidates, which no event tells of.
  kCandidateSeenThrough,
  kNeverConfirmed,
  kCandidateLapsed,
};

struct RuleInfo {
  Rule rule;
  const char* name;               ///< in events, on the bus and in files
  std::vector<EventKind> events;  ///< that it may be told by
};

/// All rules, in the order of the enum.
const std::vector<RuleInfo>& all_rules();

/// Name of the rule, as in Evidence::rule. `other`: for kJoined, the object that was joined.
std::string rule_text(Rule rule, ObjectId other = ObjectId::kNone);

/// The rule of an event's text; nothing when it is none of these: what an operator said
/// (operator_word.hpp), or a rule of another program.
std::optional<Rule> rule_of(const std::string& text);

/// Of a thing that is reported as ADDED.
Rule added_rule(Arrival arrival);

}  // namespace pocd

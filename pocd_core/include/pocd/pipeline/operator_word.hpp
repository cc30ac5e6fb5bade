// What an operator says of the map, beside what cameras see.
#pragma once

#include <cstdint>
#include <string>

#include "pocd/common/polygon.hpp"
#include "pocd/objects/frame_result.hpp"

namespace pocd {

enum class WordKind : std::uint8_t {
  kForgetObject = 0,  ///< nothing is known of it any more; it is ADDED anew when it is seen
  kForgetRegion,  ///< the same for all objects with their middle in the polygon, and the map there
  kReset,         ///< the same for everything; ignored regions and numbers stay
  kIgnoreRegion,  ///< what is seen in or through the polygon is not used, until heeded again
  kHeedRegion,    ///< ends kIgnoreRegion
  kConfirmRemoval,  ///< the object is REMOVED: a person has seen that it is gone
  kSave             ///< nothing changes; for a memory, which writes at once
};
constexpr int kWordKinds = 7;
const char* to_string(WordKind kind);  ///< "forget_object", ... as the rule of events

struct OperatorWord {
  static constexpr std::size_t kMostCorners = 1000;
  static constexpr std::size_t kMostText = 200;  ///< bytes of a name
  static constexpr double kFarthest_m = 1e6;

  WordKind kind = WordKind::kSave;
  ObjectId object = ObjectId::kNone;  ///< kForgetObject, kConfirmRemoval
  Polygon polygon_W;                  ///< kForgetRegion, kIgnoreRegion
  std::string region;  ///< kIgnoreRegion, kHeedRegion: its name; one that is there is replaced
  std::string by;      ///< who says so; not empty
};

struct WordOutcome {
  bool done = false;
  std::string text;  ///< what was done, or why nothing was
  /// Events, and ids that are retired. The last event is the word itself, of kind kOperator; all of
  /// them name who said so. Empty unless done.
  FrameResult result;
};

}  // namespace pocd

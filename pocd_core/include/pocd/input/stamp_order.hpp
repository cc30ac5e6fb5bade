// Whether the stamps of one stream rise, and when the stream starts anew because they do not.
#pragma once

#include <optional>

#include "pocd/common/types.hpp"
#include "pocd/input/input_problem.hpp"

namespace pocd {

/// One stamp far in the future would mute its stream for good, and a clock that is set back for as
/// long as it was set back. So after kAgreeing refused stamps in a row that rise among themselves
/// and lie more than kFarBack behind, it is the newest one that is taken to be wrong. What lies
/// less far back is old news of a second source, or over soon.
class StampOrder {
 public:
  static constexpr int kAgreeing = 10;
  static constexpr StampNs kFarBack = 1'000'000'000;

  /// kRestarted: as kAccepted, but everything at this stamp or later that came before is void.
  enum class Verdict { kAccepted, kRefused, kRestarted };
  Verdict judge(StampNs stamp_ns);

  /// The last one that was not refused.
  const std::optional<StampNs>& newest_ns() const { return newest_ns_; }

 private:
  std::optional<StampNs> newest_ns_;
  StampNs refused_ns_ = 0;
  int refused_in_a_row_ = 0;
};

/// kStampBackwards, kStampsRestarted, or nothing; `before_ns` is the newest stamp before.
std::optional<InputProblem> stamp_problem(StampOrder::Verdict verdict, StampNs stamp_ns,
                                          StampNs before_ns);

/// Whether what the problem is about was not taken, for its stamp.
inline bool stamp_refused(const std::optional<InputProblem>& problem) {
  return problem && problem->reason == InputReason::kStampBackwards;
}

}  // namespace pocd

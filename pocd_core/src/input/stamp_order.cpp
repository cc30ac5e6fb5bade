#include "pocd/input/stamp_order.hpp"

namespace pocd {

StampOrder::Verdict StampOrder::judge(StampNs stamp_ns) {
  if (!newest_ns_ || stamp_ns > *newest_ns_) {
    newest_ns_ = stamp_ns;
    refused_in_a_row_ = 0;
    return Verdict::kAccepted;
  }
  if (*newest_ns_ - stamp_ns <= kFarBack) {
    refused_in_a_row_ = 0;
    return Verdict::kRefused;
  }
  if (refused_in_a_row_ == 0 || stamp_ns < refused_ns_) {
    refused_in_a_row_ = 1;
  } else if (stamp_ns > refused_ns_) {
    ++refused_in_a_row_;
  }
  refused_ns_ = stamp_ns;
  if (refused_in_a_row_ < kAgreeing) return Verdict::kRefused;
  newest_ns_ = stamp_ns;
  refused_in_a_row_ = 0;
  return Verdict::kRestarted;
}

std::optional<InputProblem> stamp_problem(StampOrder::Verdict verdict, StampNs stamp_ns,
                                          StampNs before_ns) {
  const std::string stamp = std::to_string(stamp_ns) + " ns";
  const std::string before = std::to_string(before_ns) + " ns";
  switch (verdict) {
    case StampOrder::Verdict::kAccepted:
      return std::nullopt;
    case StampOrder::Verdict::kRefused:
      return InputProblem{InputReason::kStampBackwards,
                          "stamp " + stamp + " is not after the last one, " + before +
                              (stamp_ns == 0 ? ": does the sender set no stamps?" : "")};
    case StampOrder::Verdict::kRestarted:
      break;
  }
  return InputProblem{InputReason::kStampsRestarted,
                      "stamp " + stamp + " is the " + std::to_string(StampOrder::kAgreeing) +
                          "th in a row far before " + before + ": the stream starts anew with it"};
}

}  // namespace pocd

#include "pocd_dds/bridge/input_problem.hpp"

#include <spdlog/spdlog.h>

namespace pocd::dds {

const char* to_string(InputReason reason) {
  switch (reason) {
    case InputReason::kEmptyImage:
      return "empty_image";
    case InputReason::kUnknownEncoding:
      return "unknown_encoding";
    case InputReason::kBigEndian:
      return "big_endian";
    case InputReason::kStepTooSmall:
      return "step_too_small";
    case InputReason::kDataSize:
      return "data_size";
    case InputReason::kTooLarge:
      return "too_large";
    case InputReason::kUnknownColour:
      return "unknown_colour";
    case InputReason::kBadImageSize:
      return "bad_image_size";
    case InputReason::kZeroFocalLength:
      return "zero_focal_length";
    case InputReason::kNotFinite:
      return "not_finite";
    case InputReason::kNonUnitQuaternion:
      return "non_unit_quaternion";
    case InputReason::kEmptyFrameName:
      return "empty_frame_name";
    case InputReason::kStampBackwards:
      return "stamp_backwards";
    case InputReason::kSizesDisagree:
      return "sizes_disagree";
      return "not_rectified";
  }
  return "";
}

void ProblemCounter::count(const std::string& topic, const InputProblem& problem,
                           std::uint64_t times) {
  std::uint64_t& seen = counts_[{topic, problem.reason}];
  if (seen == 0) {
    spdlog::warn("{}: {}: {} (logged once, counted in diagnostics)", topic,
                 to_string(problem.reason), problem.detail);
  }
  seen += times;
}

std::vector<ProblemCounter::Entry> ProblemCounter::entries() const {
  std::vector<Entry> entries;
  for (const auto& [key, count] : counts_) {
    entries.push_back({key.first, to_string(key.second), count});
  }
  return entries;
}

std::uint64_t ProblemCounter::total() const {
  std::uint64_t total = 0;
  for (const auto& [key, count] : counts_) total += count;
  return total;
}

}  // namespace pocd::dds

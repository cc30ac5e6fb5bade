// What can be wrong with a message, by name, and how often it was.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pocd::dds {

enum class InputReason {
  kEmptyImage,
  kUnknownEncoding,
  kBigEndian,
  kStepTooSmall,
  kDataSize,
  kTooLarge,
  kUnknownColour,
  kBadImageSize,
  kZeroFocalLength,
  kNotFinite,
  kNonUnitQuaternion,
  kEmptyFrameName,
  kStampBackwards,
  kSizesDisagree,
};
const char* to_string(InputReason reason);  ///< "unknown_encoding", ...

struct InputProblem {
  InputReason reason;
  std::string detail;  ///< field and value
};

/// A value, or what is wrong with the message that should have given it.
template <class T>
struct Checked {
  std::optional<T> value;
  std::optional<InputProblem> problem;

  Checked(T good) : value(std::move(good)) {}  // NOLINT: meant to be implicit
  Checked(InputReason reason, std::string detail)
      : problem(InputProblem{reason, std::move(detail)}) {}
};

/// Counts problems by topic and reason; each pair is logged the first time only. Not thread-safe.
class ProblemCounter {
 public:
  void count(const std::string& topic, const InputProblem& problem, std::uint64_t times = 1);

  struct Entry {
    std::string topic;
    std::string reason;
    std::uint64_t count;
  };
  /// By topic, then reason.
  std::vector<Entry> entries() const;
  std::uint64_t total() const;

 private:
  std::map<std::pair<std::string, InputReason>, std::uint64_t> counts_;
};

}  // namespace pocd::dds

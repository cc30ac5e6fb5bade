// What can be wrong with a message, by name; the same words wherever messages come from.
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace pocd {

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
  kBadIntrinsics,
  kNotFinite,
  kNonUnitQuaternion,
  kEmptyFrameName,
  kStampBackwards,
  kStampsRestarted,
  kSizesDisagree,
  kWrongType,
  kFrameChanged,
  kParentChanged,
  kNoTransform,
  kTransformLoop,
  kNoPose,
  kSilentStream,
  kIncompatibleQos,
  kCameraChanged,
};
const char* to_string(InputReason reason);  ///< "unknown_encoding", ...

struct InputProblem {
  InputReason reason;
  std::string detail;  ///< field and value
};

/// Whether the data that the problem is about is used all the same.
inline bool used_anyway(const InputProblem& problem) {
  return problem.reason == InputReason::kParentChanged ||
         problem.reason == InputReason::kStampsRestarted ||
         problem.reason == InputReason::kCameraChanged;
}

/// A value, or what is wrong with the message that should have given it.
template <class T>
struct Checked {
  std::optional<T> value;
  std::optional<InputProblem> problem;

  Checked(T good) : value(std::move(good)) {}             // NOLINT: meant to be implicit
  Checked(InputProblem bad) : problem(std::move(bad)) {}  // NOLINT: meant to be implicit
  Checked(InputReason reason, std::string detail)
      : problem(InputProblem{reason, std::move(detail)}) {}
};

}  // namespace pocd

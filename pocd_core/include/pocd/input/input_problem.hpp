// What can be wrong with a message, by name; the same words wherever messages come from.
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace pocd {

enum class InputReason {
  kEmptyImage,
  kUnknownEncoding,
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
  kBadCompression,
  kUnlistedClass,
  kNoMask,
  kNoUsableDepth,
  kOtherFrame,
};
const char* to_string(InputReason reason);  ///< "unknown_encoding", ...

struct InputProblem {
  InputReason reason;
  std::string detail;  ///< field and value
};

/// Whether the data that the problem is about is used all the same.
inline bool used_anyway(const InputProblem& problem) {
  switch (problem.reason) {
    case InputReason::kParentChanged:
    case InputReason::kStampsRestarted:
    case InputReason::kCameraChanged:
    case InputReason::kUnknownColour:
    case InputReason::kUnlistedClass:
    case InputReason::kNoMask:
    case InputReason::kNoUsableDepth:
    case InputReason::kOtherFrame:
      return true;
    default:
      return false;
  }
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

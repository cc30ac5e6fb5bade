#include "pocd/input/input_problem.hpp"

namespace pocd {

const char* to_string(InputReason reason) {
  switch (reason) {
    case InputReason::kEmptyImage:
      return "empty_image";
    case InputReason::kUnknownEncoding:
      return "unknown_encoding";
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
    case InputReason::kBadIntrinsics:
      return "bad_intrinsics";
    case InputReason::kNotFinite:
      return "not_finite";
    case InputReason::kNonUnitQuaternion:
      return "non_unit_quaternion";
    case InputReason::kEmptyFrameName:
      return "empty_frame_name";
    case InputReason::kStampBackwards:
      return "stamp_backwards";
    case InputReason::kStampsRestarted:
      return "stamps_restarted";
    case InputReason::kSizesDisagree:
      return "sizes_disagree";
    case InputReason::kWrongType:
      return "wrong_type";
    case InputReason::kFrameChanged:
      return "frame_changed";
    case InputReason::kParentChanged:
      return "parent_changed";
    case InputReason::kNoTransform:
      return "no_transform";
    case InputReason::kTransformLoop:
      return "transform_loop";
    case InputReason::kNoPose:
      return "no_pose";
    case InputReason::kSilentStream:
      return "silent_stream";
    case InputReason::kIncompatibleQos:
      return "incompatible_qos";
    case InputReason::kCameraChanged:
      return "camera_changed";
    case InputReason::kBadCompression:
      return "bad_compression";
    case InputReason::kUnlistedClass:
      return "unlisted_class";
    case InputReason::kNoMask:
      return "no_mask";
    case InputReason::kNoUsableDepth:
      return "no_usable_depth";
    case InputReason::kOtherFrame:
      return "other_frame";
  }
  return "";
}

}  // namespace pocd

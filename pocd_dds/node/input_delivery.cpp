#include "pocd_dds/node/input_delivery.hpp"

#include <string_view>

namespace pocd::dds {
namespace {

const TopicSpec& line_of(InputStream stream) {
  switch (stream) {
    case InputStream::kDepth:
      return topics::kDepth;
    case InputStream::kSegmentation:
      return topics::kSegmentation;
    case InputStream::kColor:
      return topics::kColor;
    case InputStream::kCameraInfo:
      return topics::kCameraInfo;
    case InputStream::kOdometry:
      return topics::kOdometry;
    case InputStream::kTf:
      return topics::kTf;
    case InputStream::kTfStatic:
      break;
  }
  return topics::kTfStatic;
}

}  // namespace

TopicSpec spec_of(InputStream stream, bool compressed) {
  TopicSpec spec = line_of(stream);
  if (compressed) spec.type = topics::kCompressedImageType;
  return spec;
}

Delivery input_delivery(const TopicSpec& spec, bool lossless) {
  if (!lossless) return spec.delivery;
  constexpr int kImages = 8, kSmallOnes = 1000;
  const std::string_view type = spec.type;
  const bool images = type == topics::kDepth.type || type == topics::kCompressedImageType;
  return {true, false, 0, images ? kImages : kSmallOnes, 0, false, 0};
}

}  // namespace pocd::dds

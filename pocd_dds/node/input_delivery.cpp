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

bool has_images(const TopicSpec& spec) {
  const std::string_view type = spec.type;
  return type == topics::kDepth.type || type == topics::kCompressedImageType;
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
  return {true, false, 0, has_images(spec) ? kImages : kSmallOnes, 0, false, 0};
}

Delivery input_delivery(const TopicSpec& spec, const NodeConfig& node) {
  Delivery delivery = input_delivery(spec, node.lossless);
  if (node.reliable_tf_and_info && !has_images(spec)) delivery.reliable = true;
  return delivery;
}

}  // namespace pocd::dds

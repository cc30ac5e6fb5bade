#include "pocd_dds/bridge/image_visit.hpp"

#include "pocd/recording/bytes.hpp"
#include "pocd_dds/entities/topic_table.hpp"
#include "sensor_msgsPubSubTypes.h"

namespace pocd::dds {

using eprosima::fastrtps::rtps::SerializedPayload_t;

ImageVisitType::ImageVisitType(bool compressed) : compressed_(compressed) {
  const sensor_msgs::msg::ImagePubSubType generated;
  setName(compressed ? topics::kCompressedImageType : generated.getName());
  m_typeSize = generated.m_typeSize;
  m_isGetKeyDefined = false;
}

bool ImageVisitType::deserialize(SerializedPayload_t* payload, void* data) {
  recording::RosImage image;
  try {
    image = compressed_ ? recording::decode_compressed_image(payload->data, payload->length)
                        : recording::decode_image(payload->data, payload->length);
  } catch (const recording::DamagedData&) {
    return false;
  }
  auto& visit = *static_cast<ImageVisit*>(data);
  try {
    if (visit.use) visit.use(image);
  } catch (...) {
    visit.failure = std::current_exception();
  }
  return true;
}

std::function<std::uint32_t()> ImageVisitType::getSerializedSizeProvider(void*) {
  return [] { return 0u; };
}

}  // namespace pocd::dds

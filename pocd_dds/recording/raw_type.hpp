// Samples of any type as they are on the wire.
#pragma once

#include <array>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <optional>
#include <string>

#include "pocd/recording/bytes.hpp"

namespace pocd::dds {

using InstanceKey = std::array<std::uint8_t, 16>;

/// A payload with its encapsulation header.
struct RawSample {
  recording::Bytes payload;
  /// Instance of a keyed topic, when it is known otherwise than from the payload.
  std::optional<InstanceKey> key;
};

/// Gives the instance that a payload belongs to; nothing when it cannot be told.
using KeyOf = std::function<std::optional<InstanceKey>(const recording::Bytes&)>;

/// Copies payloads. A keyed type whose `key_of` cannot tell has one instance.
class RawType : public eprosima::fastdds::dds::TopicDataType {
 public:
  RawType(const std::string& name, bool keyed, KeyOf key_of);

  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override;
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override;
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override;
  void* createData() override { return new RawSample; }
  void deleteData(void* data) override { delete static_cast<RawSample*>(data); }
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool force_md5) override;

 private:
  KeyOf key_of_;
};

}  // namespace pocd::dds

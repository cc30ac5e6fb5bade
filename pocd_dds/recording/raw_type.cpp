#include "pocd_dds/recording/raw_type.hpp"

#include <algorithm>
#include <utility>

namespace pocd::dds {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

RawType::RawType(const std::string& name, bool keyed, KeyOf key_of) : key_of_(std::move(key_of)) {
  setName(name.c_str());
  m_typeSize = 4 + 1024;  // where buffers start; they grow
  m_isGetKeyDefined = keyed;
}

bool RawType::serialize(void* data, SerializedPayload_t* payload) {
  const recording::Bytes& bytes = static_cast<RawSample*>(data)->payload;
  if (bytes.size() > payload->max_size) return false;
  std::copy(bytes.begin(), bytes.end(), payload->data);
  payload->length = static_cast<std::uint32_t>(bytes.size());
  payload->encapsulation = bytes.size() > 1 && bytes[1] == 0 ? CDR_BE : CDR_LE;
  return true;
}

bool RawType::deserialize(SerializedPayload_t* payload, void* data) {
  static_cast<RawSample*>(data)->payload.assign(payload->data, payload->data + payload->length);
  return true;
}

std::function<std::uint32_t()> RawType::getSerializedSizeProvider(void* data) {
  return
      [data] { return static_cast<std::uint32_t>(static_cast<RawSample*>(data)->payload.size()); };
}

bool RawType::getKey(void* data, InstanceHandle_t* handle, bool /*force_md5*/) {
  if (!m_isGetKeyDefined) return false;
  const auto* sample = static_cast<RawSample*>(data);
  std::optional<InstanceKey> key = sample->key;
  if (!key && key_of_) key = key_of_(sample->payload);
  if (!key) {
    key.emplace();
    key->back() = 1;  // a handle of zeros means "none"
  }
  for (std::size_t i = 0; i < key->size(); ++i) handle->value[i] = (*key)[i];
  return true;
}

}  // namespace pocd::dds

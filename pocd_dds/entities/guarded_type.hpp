// Type support that no payload gets an exception through.
#pragma once

#include <fastdds/rtps/common/SerializedPayload.h>
#include <cstdint>
#include <exception>
#include <type_traits>
#include <utility>

namespace pocd::dds {

/// Payloads that could not be read, by this thread so far.
inline std::uint64_t& damaged_payloads() {
  thread_local std::uint64_t count = 0;
  return count;
}

/// Of a payload whose type begins with a sequence: whether it can hold as many elements as it says.
/// Fast CDR asks for a byte per element only, and makes room for them all before it reads the
/// first: a payload of 1 MB would cost as many times sizeof(element).
inline bool holds_its_sequence(const eprosima::fastrtps::rtps::SerializedPayload_t& payload,
                               std::uint32_t element_bytes) {
  constexpr std::uint32_t kHeader = 4, kLength = 4;  // of the encapsulation, of a number
  if (payload.length < kHeader + kLength) return false;
  const auto* bytes = payload.data + kHeader;
  const bool little = payload.data[1] % 2 == 1;
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < kLength; ++i) {
    count = count << 8 | bytes[little ? kLength - 1 - i : i];
  }
  return count <= (payload.length - kHeader - kLength) / element_bytes;
}

/// Least bytes of an element of the sequence that a type begins with; 0: nothing to check. Other
/// types have sequences behind other fields; they cost the same factor of what was sent.
template <class Message, class = void>
inline constexpr std::uint32_t kElementBytes = 0;
/// tf2_msgs/TFMessage, on the topic that most peers write to: stamp, two names, seven numbers.
template <class Message>
inline constexpr std::uint32_t
    kElementBytes<Message, std::void_t<decltype(std::declval<Message&>().transforms())>> = 72;

/// A generated type support lets exceptions of Fast CDR through, and Fast DDS does not catch them
/// either: one byte of a peer would end the process. Here such a payload is counted and left out.
template <class PubSubType>
class GuardedType : public PubSubType {
 public:
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      constexpr std::uint32_t kElement = kElementBytes<typename PubSubType::type>;
      const bool plausible = kElement == 0 || holds_its_sequence(*payload, kElement);
      if (plausible && PubSubType::deserialize(payload, data)) return true;
    } catch (const std::exception&) {  // counted below
    }
    ++damaged_payloads();
    return false;
  }
};

/// The same bytes under another name and without a key, as ROS 2 readers ask for: the generated
/// type support decides neither.
template <class PubSubType>
class RenamedType : public GuardedType<PubSubType> {
 public:
  explicit RenamedType(const char* name) {
    this->setName(name);
    this->m_isGetKeyDefined = false;
  }
};

}  // namespace pocd::dds

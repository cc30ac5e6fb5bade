// libFuzzer harness: any bytes as a recording, and every payload as every message. Built by
// test/fuzz/run.sh with clang; what it looks for are crashes, leaks, endless loops and memory.
#include "pocd/common/check.hpp"
#include "pocd/recording/mcap_reader.hpp"
#include "pocd/recording/ros_messages.hpp"

namespace {

using namespace pocd::recording;  // NOLINT

template <class Decode>
void try_decode(Decode decode, const RecordedMessage& message) {
  try {
    decode(message.data, message.size);
  } catch (const DamagedData&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  RecordedMessage raw;
  raw.data = data;
  raw.size = size;
  try_decode(decode_tf, raw);
  ReaderLimits limits;
  limits.chunk_bytes = 1u << 18;
  limits.loaded_bytes = 1u << 20;
  try {
    McapReader reader(memory_source(Bytes(data, data + size)), "fuzz", limits);
    reader.verify();
    for (const std::uint64_t from : {std::uint64_t{0}, reader.info().end_ns / 2}) {
      reader.seek(from);
      RecordedMessage message;
      while (reader.next(message)) {
        try_decode(decode_image, message);
        try_decode(decode_camera_info, message);
        try_decode(decode_odometry, message);
        try_decode(decode_tf, message);
      }
    }
  } catch (const pocd::InputError&) {
  }
  return 0;
}

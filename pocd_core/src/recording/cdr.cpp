#include "pocd/recording/cdr.hpp"

namespace pocd::recording {
namespace {

constexpr bool kHostIsLittle = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;

}  // namespace

CdrReader::CdrReader(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {
  if (size < 4) {
    throw DamagedData(0,
                      "payload of " + std::to_string(size) + " bytes has no encapsulation header");
  }
  if (data[0] != 0 || data[1] > 1) {
    throw DamagedData(
        0, "encapsulation " + std::to_string(data[0] * 256 + data[1]) + " is not plain CDR (0, 1)");
  }
  swap_ = (data[1] == 1) != kHostIsLittle;
}

void CdrReader::align(std::size_t to) {
  const std::size_t past = (position_ - 4) % to;
  if (past == 0) return;
  need(to - past);
  position_ += to - past;
}

void CdrReader::need(std::size_t count) const {
  if (count > remaining()) {
    throw DamagedData(position_, std::to_string(count) + " bytes of payload are missing");
  }
}

std::string CdrReader::string() {
  const std::size_t length = number<std::uint32_t>();
  need(length);
  const auto* text = reinterpret_cast<const char*>(data_ + position_);
  position_ += length;
  if (length == 0) return {};  // some writers leave out the end of an empty string
  return std::string(text, text[length - 1] == '\0' ? length - 1 : length);
}

std::size_t CdrReader::length(std::size_t least_bytes) {
  const std::size_t at = position_;
  const std::size_t count = number<std::uint32_t>();
  if (count > remaining() / least_bytes) {
    throw DamagedData(at, "sequence of " + std::to_string(count) + " elements, but only " +
                              std::to_string(remaining()) + " bytes are left");
  }
  return count;
}

const std::uint8_t* CdrReader::bytes(std::size_t size) {
  need(size);
  const std::uint8_t* here = data_ + position_;
  position_ += size;
  return here;
}

CdrWriter::CdrWriter(bool little_endian)
    : bytes_{0, static_cast<std::uint8_t>(little_endian ? 1 : 0), 0, 0},
      swap_(little_endian != kHostIsLittle) {}

void CdrWriter::string(const std::string& text) {
  number(static_cast<std::uint32_t>(text.size() + 1));
  raw(text.c_str(), text.size() + 1);
}

void CdrWriter::raw(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  bytes_.insert(bytes_.end(), bytes, bytes + size);
}

}  // namespace pocd::recording

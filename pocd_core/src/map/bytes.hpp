// Little-endian integers in byte buffers, on every host.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace pocd {

template <class Integer>
void put(std::vector<std::uint8_t>& out, Integer value) {
  for (std::size_t i = 0; i < sizeof(Integer); ++i) {
    out.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
  }
}

inline void put_double(std::vector<std::uint8_t>& out, double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  put(out, bits);
}

template <class Integer>
Integer get(const std::uint8_t* in) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) {
    value |= static_cast<std::uint64_t>(in[i]) << (8 * i);
  }
  return static_cast<Integer>(value);
}

inline double get_double(const std::uint8_t* in) {
  const auto bits = get<std::uint64_t>(in);
  double value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

}  // namespace pocd

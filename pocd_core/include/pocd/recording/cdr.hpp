// Plain CDR (XCDR version 1, DDS-XTypes 1.3, 7.4.1) with its encapsulation header, without
// middleware.
#pragma once

#include <cstring>
#include <string>
#include <type_traits>

#include "pocd/recording/bytes.hpp"

namespace pocd::recording {

/// Reads a payload in the order of its fields. Throws DamagedData rather than leave the buffer,
/// which must outlive the reader.
class CdrReader {
 public:
  /// Refuses encapsulations other than plain CDR, little or big endian, by number.
  CdrReader(const std::uint8_t* data, std::size_t size);

  /// Integers, float, double; aligned to its size.
  template <class T>
  T number() {
    static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>);
    align(sizeof(T));
    need(sizeof(T));
    std::uint8_t bytes[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes[i] = data_[position_ + (swap_ ? sizeof(T) - 1 - i : i)];
    }
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    position_ += sizeof(T);
    return value;
  }
  bool boolean() { return number<std::uint8_t>() != 0; }
  std::string string();
  /// Number of elements, of at least `least_bytes` each; more than can be there are damage.
  std::size_t length(std::size_t least_bytes);
  /// The next `size` bytes, as a view.
  const std::uint8_t* bytes(std::size_t size);
  void skip(std::size_t size) { bytes(size); }

  std::size_t remaining() const { return size_ - position_; }

 private:
  void align(std::size_t to);
  void need(std::size_t count) const;

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t position_ = 4;  // alignment counts from behind the encapsulation header
  bool swap_ = false;
};

/// Writes what CdrReader reads.
class CdrWriter {
 public:
  explicit CdrWriter(bool little_endian = true);

  template <class T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>);
    while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_.push_back(0);
    std::uint8_t bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(bytes[swap_ ? sizeof(T) - 1 - i : i]);
    }
  }
  void string(const std::string& text);
  void raw(const void* data, std::size_t size);

  const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
  bool swap_ = false;
};

}  // namespace pocd::recording

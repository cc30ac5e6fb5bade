// Numbers and strings in byte buffers, little endian, every access checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace pocd::recording {

using Bytes = std::vector<std::uint8_t>;

/// Bytes that do not mean what they should. what() says what is wrong; offset() where, counted from
/// the start of the buffer that was read.
class DamagedData : public std::runtime_error {
 public:
  DamagedData(std::uint64_t offset, const std::string& what)
      : std::runtime_error(what), offset_(offset) {}
  std::uint64_t offset() const { return offset_; }

 private:
  std::uint64_t offset_;
};

/// A view; the buffer must outlive it. Every read throws DamagedData rather than leave the buffer.
class ByteReader {
 public:
  ByteReader(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  template <class T>
  T number() {
    static_assert(std::is_unsigned_v<T>);
    need(sizeof(T));
    T value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value =
          static_cast<T>(value | static_cast<T>(static_cast<T>(data_[position_ + i]) << (8 * i)));
    }
    position_ += sizeof(T);
    return value;
  }
  /// A string with its length before it (32 bits).
  std::string string() {
    const std::size_t length = number<std::uint32_t>();
    need(length);
    std::string text(reinterpret_cast<const char*>(data_ + position_), length);
    position_ += length;
    return text;
  }
  std::map<std::string, std::string> string_map() {
    ByteReader in = part(number<std::uint32_t>());
    std::map<std::string, std::string> map;
    while (in.remaining() > 0) {
      std::string key = in.string();
      map[std::move(key)] = in.string();
    }
    return map;
  }
  /// The next `length` bytes as a buffer of their own.
  ByteReader part(std::uint64_t length) {
    need(length);
    ByteReader in(data_ + position_, static_cast<std::size_t>(length));
    position_ += static_cast<std::size_t>(length);
    return in;
  }

  const std::uint8_t* here() const { return data_ + position_; }
  std::size_t position() const { return position_; }
  std::size_t remaining() const { return size_ - position_; }

 private:
  void need(std::uint64_t count) const {
    if (count > remaining()) {
      throw DamagedData(position_, std::to_string(count) + " bytes announced, " +
                                       std::to_string(remaining()) + " there");
    }
  }

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t position_ = 0;
};

/// Appends to a buffer.
class ByteWriter {
 public:
  explicit ByteWriter(Bytes& out) : out_(out) {}

  template <class T>
  void number(T value) {
    static_assert(std::is_unsigned_v<T>);
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      out_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
  }
  void raw(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const std::uint8_t*>(data);
    out_.insert(out_.end(), bytes, bytes + size);
  }
  void string(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    raw(text.data(), text.size());
  }
  void string_map(const std::map<std::string, std::string>& map) {
    Bytes body;
    ByteWriter out(body);
    for (const auto& [key, value] : map) {
      out.string(key);
      out.string(value);
    }
    number(static_cast<std::uint32_t>(body.size()));
    raw(body.data(), body.size());
  }

 private:
  Bytes& out_;
};

}  // namespace pocd::recording

// Values to bytes and back, by one description for both directions.
//
// A struct is described once, by a function that argument-dependent look-up finds:
//
//   template <class Archive>
//   void archive(Archive& a, Belief& b) { a(b.mu, b.sigma, b.alpha, b.beta); }
//
// Private members are described by members of ArchiveAccess, which the class befriends. Numbers are
// little-endian and keep every bit; containers are a count and their elements.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "pocd/common/check.hpp"

namespace pocd {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "archives are copies of memory");

/// Members describe the private parts of classes; each part of the core adds what is its own.
struct ArchiveAccess;

/// Collects bytes. Not thread-safe.
class SaveArchive {
 public:
  static constexpr bool kLoads = false;

  template <class... Values>
  void operator()(const Values&... values);

  /// Number of the layout of what follows, so that a later program can tell.
  std::uint8_t version(std::uint8_t known, std::uint8_t /*oldest*/ = 0) {
    raw(&known, 1);
    return known;
  }
  void raw(const void* from, std::size_t size) {
    const auto* bytes = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), bytes, bytes + size);
  }
  std::uint32_t count(std::size_t size) {
    const auto n = static_cast<std::uint32_t>(size);
    raw(&n, sizeof n);
    return n;
  }
  /// What follows is unlike what came before: who compresses it does well to start anew here.
  void section() { sections_.push_back(bytes_.size()); }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }
  /// Where sections begin.
  std::vector<std::size_t> take_sections() { return std::move(sections_); }

 private:
  std::vector<std::uint8_t> bytes_;
  std::vector<std::size_t> sections_;
};

/// Reads what SaveArchive wrote. Every read is checked against the end; memory is bounded by the
/// number of bytes. Throws InputError naming `source`. Not thread-safe.
class LoadArchive {
 public:
  static constexpr bool kLoads = true;

  LoadArchive(const std::vector<std::uint8_t>& bytes, std::string source)
      : at_(bytes.data()), end_(bytes.data() + bytes.size()), source_(std::move(source)) {}

  template <class... Values>
  void operator()(Values&... values);

  /// The layout that was written: `known`, or an older one from `oldest` on, 0 being none.
  std::uint8_t version(std::uint8_t known, std::uint8_t oldest = 0) {
    std::uint8_t found = 0;
    raw(&found, 1);
    if (found != known && (oldest == 0 || found < oldest || found > known)) {
      fail("layout " + std::to_string(found) + ", this program knows " + std::to_string(known));
    }
    return found;
  }
  void raw(void* to, std::size_t size) {
    if (size > left()) fail("ends before its time");
    std::memcpy(to, at_, size);
    at_ += size;
  }
  void section() {}
  /// A number of elements of which each takes at least one byte.
  std::uint32_t count(std::size_t /*size*/) {
    std::uint32_t n = 0;
    raw(&n, sizeof n);
    if (n > left()) fail("holds more elements than bytes");
    return n;
  }
  /// Nothing may follow.
  void finish() const {
    if (at_ != end_) fail("is longer than what it holds");
  }
  [[noreturn]] void fail(const std::string& reason) const {
    throw InputError(source_ + ": " + reason);
  }

 private:
  std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }

  const std::uint8_t* at_;
  const std::uint8_t* end_;
  std::string source_;
};

namespace archives {

template <class Archive, class T>
void value(Archive& a, T& v);

template <class Archive, class T>
void elements(Archive& a, T& list) {
  const std::uint32_t n = a.count(list.size());
  if constexpr (Archive::kLoads) {
    list.clear();
    for (std::uint32_t i = 0; i < n; ++i) value(a, list.emplace_back());
  } else {
    for (auto& v : list) value(a, v);
  }
}

template <class Archive, class T, class Allocator>
void one(Archive& a, std::vector<T, Allocator>& list) {
  elements(a, list);
}
template <class Archive, class T>
void one(Archive& a, std::deque<T>& list) {
  elements(a, list);
}
template <class Archive>
void one(Archive& a, std::string& text) {
  text.resize(a.count(text.size()));
  a.raw(text.data(), text.size());
}
template <class Archive, class T>
void one(Archive& a, std::optional<T>& v) {
  bool there = v.has_value();
  value(a, there);
  if constexpr (Archive::kLoads) {
    v.reset();
    if (there) v.emplace();
  }
  if (there) value(a, *v);
}
template <class Archive, class T>
void one(Archive& a, std::set<T>& list) {
  const std::uint32_t n = a.count(list.size());
  if constexpr (Archive::kLoads) {
    list.clear();
    for (std::uint32_t i = 0; i < n; ++i) {
      T v{};
      value(a, v);
      list.insert(std::move(v));
    }
  } else {
    for (const T& v : list) value(a, const_cast<T&>(v));
  }
}
template <class Archive, class Key, class T>
void one(Archive& a, std::map<Key, T>& list) {
  const std::uint32_t n = a.count(list.size());
  if constexpr (Archive::kLoads) {
    list.clear();
    for (std::uint32_t i = 0; i < n; ++i) {
      Key key{};
      value(a, key);
      value(a, list[key]);
    }
  } else {
    for (auto& [key, v] : list) {
      value(a, const_cast<Key&>(key));
      value(a, v);
    }
  }
}
template <class Archive, class A, class B>
void one(Archive& a, std::pair<A, B>& v) {
  value(a, v.first);
  value(a, v.second);
}
template <class Archive, class T, std::size_t N>
void one(Archive& a, std::array<T, N>& list) {
  for (T& v : list) value(a, v);
}
template <class Archive, class Scalar, int Rows, int Columns>
void one(Archive& a, Eigen::Matrix<Scalar, Rows, Columns>& m) {
  static_assert(Rows > 0 && Columns > 0, "sizes are fixed");
  a.raw(m.data(), sizeof(Scalar) * Rows * Columns);
}
/// All sixteen numbers: the same bits, whatever the transform has gone through.
template <class Archive, class Scalar>
void one(Archive& a, Eigen::Transform<Scalar, 3, Eigen::Isometry>& T) {
  one(a, T.matrix());
}
template <class Archive, class T>
std::enable_if_t<std::is_arithmetic_v<T> || std::is_enum_v<T>> one(Archive& a, T& v) {
  if constexpr (std::is_same_v<T, bool>) {
    std::uint8_t byte = v ? 1 : 0;
    a.raw(&byte, 1);
    if constexpr (Archive::kLoads) {
      if (byte > 1) a.fail("holds a truth value that is none");
      v = byte == 1;
    }
  } else {
    a.raw(&v, sizeof v);
  }
}
template <class Archive, class T>
std::enable_if_t<std::is_class_v<T>> described(Archive& a, T& v) {
  archive(a, v);  // found by argument-dependent look-up
}

template <class T, class = void>
struct HasOne : std::false_type {};
template <class T>
struct HasOne<T, std::void_t<decltype(one(std::declval<SaveArchive&>(), std::declval<T&>()))>>
    : std::true_type {};

template <class Archive, class T>
void value(Archive& a, T& v) {
  if constexpr (HasOne<T>::value) {
    one(a, v);
  } else {
    described(a, v);
  }
}

}  // namespace archives

template <class... Values>
void SaveArchive::operator()(const Values&... values) {
  (archives::value(*this, const_cast<Values&>(values)), ...);
}

template <class... Values>
void LoadArchive::operator()(Values&... values) {
  (archives::value(*this, values), ...);
}

/// The bytes of one value.
template <class T>
std::vector<std::uint8_t> archived(const T& value) {
  SaveArchive a;
  a(value);
  return a.take();
}

/// The value of the bytes, all of them. Throws InputError naming `source`.
template <class T>
void unarchive(const std::vector<std::uint8_t>& bytes, const std::string& source, T& value) {
  LoadArchive a(bytes, source);
  a(value);
  a.finish();
}

}  // namespace pocd

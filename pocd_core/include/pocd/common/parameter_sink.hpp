// The bridge between describe() templates and code that is compiled once: every visitor of
// parameters is a ParameterSink, and DescribeAdapter is the Visitor that calls it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "pocd/common/describe.hpp"

namespace pocd {

class ParameterSink;

/// A std::vector of described structs whose element type is not known to the sink.
class ItemList {
 public:
  virtual ~ItemList() = default;
  virtual std::size_t size() const = 0;
  /// Throws all items away and makes `count` with the defaults of their type.
  virtual void reset(std::size_t count) = 0;
  virtual void describe_item(std::size_t index, ParameterSink& sink) = 0;
  /// Shows the fields of an item with the defaults of its type.
  virtual void describe_default(ParameterSink& sink) = 0;
};

/// Receives every parameter in the order of describe(). Values are references into the struct, to
/// be read or written. Names are those of one group; begin_group/end_group nest.
class ParameterSink {
 public:
  virtual ~ParameterSink() = default;
  virtual void real(const char* name, double& value, const Range& range, const char* doc) = 0;
  virtual void integer(const char* name, int& value, const Range& range, const char* doc) = 0;
  virtual void natural(const char* name, std::uint64_t& value, const Range& range,
                       const char* doc) = 0;
  virtual void boolean(const char* name, bool& value, const char* doc) = 0;
  virtual void text(const char* name, std::string& value, const char* doc) = 0;
  /// `word` is that of an enum's value; another one of `choices` sets it.
  virtual void choice(const char* name, std::string& word, const std::vector<std::string>& choices,
                      const char* doc) = 0;
  virtual void texts(const char* name, std::vector<std::string>& values, const char* doc) = 0;
  virtual void items(const char* name, ItemList& list, const char* doc) = 0;
  virtual void begin_group(const char* name, const char* doc) = 0;
  virtual void end_group() = 0;
  /// A rule between parameters of the current group that its values break.
  virtual void inconsistent(const std::string& /*problem*/) {}
};

/// Shows `config` to `sink`: its describe(), then, where the struct has one,
/// `std::vector<std::string> inconsistencies() const`, one line per broken rule between fields.
template <class T>
void show_parameters(T& config, ParameterSink& sink);

/// The Visitor that describe() functions are called with.
class DescribeAdapter {
 public:
  explicit DescribeAdapter(ParameterSink& sink) : sink_(sink) {}

  void operator()(const char* name, double& value, const Range& range, const char* doc) {
    sink_.real(name, value, range, doc);
  }
  void operator()(const char* name, int& value, const Range& range, const char* doc) {
    sink_.integer(name, value, range, doc);
  }
  void operator()(const char* name, std::uint64_t& value, const Range& range, const char* doc) {
    sink_.natural(name, value, range, doc);
  }
  void operator()(const char* name, bool& value, const char* doc) {
    sink_.boolean(name, value, doc);
  }
  void operator()(const char* name, std::string& value, const char* doc) {
    sink_.text(name, value, doc);
  }
  template <class Enum, class = std::enable_if_t<std::is_enum_v<Enum>>>
  void operator()(const char* name, Enum& value, const char* doc) {
    std::string word = word_of(value);
    sink_.choice(name, word, choices_of<Enum>(), doc);
    value = value_of<Enum>(word).value_or(value);
  }
  void operator()(const char* name, std::vector<std::string>& values, const char* doc) {
    sink_.texts(name, values, doc);
  }
  template <class Item>
  void operator()(const char* name, std::vector<Item>& items, const char* doc);

  template <class T>
  void group(const char* name, T& nested, const char* doc) {
    sink_.begin_group(name, doc);
    show_parameters(nested, sink_);
    sink_.end_group();
  }

 private:
  ParameterSink& sink_;
};

namespace config_detail {

template <class T, class = void>
struct HasInconsistencies : std::false_type {};
template <class T>
struct HasInconsistencies<T, std::void_t<decltype(std::declval<const T&>().inconsistencies())>>
    : std::true_type {};

template <class Item>
class VectorItems final : public ItemList {
 public:
  explicit VectorItems(std::vector<Item>& items) : items_(items) {}
  std::size_t size() const override { return items_.size(); }
  void reset(std::size_t count) override { items_.assign(count, Item{}); }
  void describe_item(std::size_t index, ParameterSink& sink) override {
    show_parameters(items_[index], sink);
  }
  void describe_default(ParameterSink& sink) override {
    Item item{};
    show_parameters(item, sink);
  }

 private:
  std::vector<Item>& items_;
};

}  // namespace config_detail

template <class Item>
void DescribeAdapter::operator()(const char* name, std::vector<Item>& items, const char* doc) {
  config_detail::VectorItems<Item> list(items);
  sink_.items(name, list, doc);
}

template <class T>
void show_parameters(T& config, ParameterSink& sink) {
  DescribeAdapter adapter(sink);
  config.describe(adapter);
  if constexpr (config_detail::HasInconsistencies<T>::value) {
    for (const std::string& problem : config.inconsistencies()) sink.inconsistent(problem);
  }
}

}  // namespace pocd

// Words for the values of an enum: one table for files, command lines, messages and documentation.
#pragma once

#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace pocd {

/// Values and their words. An enum that a parameter can have gets its table from a function beside
/// it, in its namespace:
///
///   inline EnumWords<MapLimit> words_of(MapLimit) {
///     return {{MapLimit::kNone, "none"}, {MapLimit::kBudget, "budget"}};
///   }
template <class Enum>
using EnumWords = std::vector<std::pair<Enum, const char*>>;

/// All words, in the order of the table.
template <class Enum>
std::vector<std::string> choices_of() {
  std::vector<std::string> words;
  for (const auto& entry : words_of(Enum{})) words.push_back(entry.second);
  return words;
}

/// Its word; its number for a value that the table does not have.
template <class Enum>
std::string word_of(Enum value) {
  for (const auto& [known, word] : words_of(Enum{})) {
    if (known == value) return word;
  }
  return std::to_string(static_cast<std::underlying_type_t<Enum>>(value));
}

/// The value of a word; nothing for any other text.
template <class Enum>
std::optional<Enum> value_of(const std::string& text) {
  for (const auto& [value, word] : words_of(Enum{})) {
    if (text == word) return value;
  }
  return std::nullopt;
}

}  // namespace pocd

// Parameters that are enumerations: visit("measure", measure, Words<Measure>{{...}}, "Meaning.").
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pocd/config/describe.hpp"

namespace pocd {

/// The values of an enumeration and the words that files have for them.
template <class Enum>
struct Words {
  std::vector<std::pair<Enum, std::string>> words;

  Choices choices() const {
    Choices out;
    for (const auto& [value, word] : words) out.words.push_back(word);
    return out;
  }
  /// A word that is no choice for a value that is none.
  std::string word_of(Enum value) const {
    for (const auto& [known, word] : words) {
      if (known == value) return word;
    }
    return std::to_string(static_cast<long long>(value));
  }
  /// `otherwise` for a word that is none.
  Enum value_of(const std::string& text, Enum otherwise) const {
    for (const auto& [value, word] : words) {
      if (word == text) return value;
    }
    return otherwise;
  }
};

}  // namespace pocd

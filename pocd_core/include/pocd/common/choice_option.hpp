// Options of a command line that are words of an enum. Needs CLI11.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "pocd/common/enum_words.hpp"

namespace pocd {

/// Any other text than a word is refused with the words. `value` lives as long as `app` parses.
template <class Enum, class Value>
CLI::Option* add_choice(CLI::App& app, const std::string& flag, Value& value,
                        const std::string& help) {
  return app
      .add_option_function<std::string>(
          flag, [&value](const std::string& word) { value = value_of<Enum>(word).value(); }, help)
      ->check(CLI::IsMember(choices_of<Enum>()));
}

/// The same for one that has a default, which the help shows.
template <class Enum>
CLI::Option* add_choice(CLI::App& app, const std::string& flag, Enum& value,
                        const std::string& help) {
  return add_choice<Enum, Enum>(app, flag, value, help)->default_str(word_of(value));
}

/// The same for words separated by commas.
template <class Enum>
CLI::Option* add_choices(CLI::App& app, const std::string& flag, std::vector<Enum>& values,
                         const std::string& help) {
  return app
      .add_option_function<std::vector<std::string>>(
          flag,
          [&values](const std::vector<std::string>& words) {
            values.clear();
            for (const std::string& word : words) values.push_back(value_of<Enum>(word).value());
          },
          help)
      ->delimiter(',')
      ->check(CLI::IsMember(choices_of<Enum>()));
}

}  // namespace pocd

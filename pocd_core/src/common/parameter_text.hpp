// Values, units and names of parameters as text.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pocd/common/describe.hpp"

namespace pocd::config_detail {

/// Shortest text that reads back to the same bits; "5" for 5.0.
std::string number_text(double value);

/// The whole of `text` as a number; nothing when anything else is in it.
std::optional<double> parse_real(const std::string& text);
std::optional<std::int64_t> parse_integer(const std::string& text);
std::optional<std::uint64_t> parse_natural(const std::string& text);

/// "m" from "Edge of a voxel [m]."; empty when the text names no unit.
std::string unit_of(const std::string& doc);

/// "0.002 to 1 m".
std::string range_text(const Range& range, const std::string& doc);

std::string join(const std::vector<std::string>& words, const std::string& separator);

/// "\"word\" is not one of: a, b".
std::string not_one_of(const std::string& word, const std::vector<std::string>& choices);

/// The candidate that `word` is a likely misspelling or shortening of, if there is one.
std::optional<std::string> closest(const std::string& word,
                                   const std::vector<std::string>& candidates);

}  // namespace pocd::config_detail

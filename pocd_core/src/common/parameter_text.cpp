#include "parameter_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace pocd::config_detail {
namespace {

template <class Number>
std::optional<Number> parse(const std::string& text) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (text.empty() || error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

/// Edits (insert, delete, replace, swap of neighbours) that turn a into b: optimal string
/// alignment.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  const std::size_t width = b.size() + 1;
  std::vector<std::size_t> d((a.size() + 1) * width);
  for (std::size_t i = 0; i <= a.size(); ++i) d[i * width] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = d[(i - 1) * width + j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      std::size_t best = std::min({d[(i - 1) * width + j] + 1, d[i * width + j - 1] + 1, replace});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        best = std::min(best, d[(i - 2) * width + j - 2] + 1);
      }
      d[i * width + j] = best;
    }
  }
  return d.back();
}

}  // namespace

std::string number_text(double value) {
  char buffer[32];
  // Whole numbers as people write them: 100000, not 1e+05. (2^53 is the end of exact ones.)
  const bool whole = std::abs(value) < 9e15 && value == std::floor(value) && !std::signbit(value);
  const auto result =
      whole ? std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::fixed)
            : std::to_chars(buffer, buffer + sizeof(buffer), value);
  return std::string(buffer, result.ptr);
}

std::optional<double> parse_real(const std::string& text) { return parse<double>(text); }
std::optional<std::int64_t> parse_integer(const std::string& text) {
  return parse<std::int64_t>(text);
}
std::optional<std::uint64_t> parse_natural(const std::string& text) {
  return parse<std::uint64_t>(text);
}

std::string unit_of(const std::string& doc) {
  const std::size_t close = doc.rfind(']');
  if (close == std::string::npos) return "";
  const std::size_t open = doc.rfind(" [", close);  // with a space: E[v] is no unit
  if (open == std::string::npos) return "";
  return doc.substr(open + 2, close - open - 2);
}

std::string range_text(const Range& range, const std::string& doc) {
  const std::string unit = unit_of(doc);
  return number_text(range.low) + " to " + number_text(range.high) +
         (unit.empty() ? "" : " " + unit);
}

std::string join(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

std::string not_one_of(const std::string& word, const std::vector<std::string>& choices) {
  return "\"" + word + "\" is not one of: " + join(choices, ", ");
}

std::optional<std::string> closest(const std::string& word,
                                   const std::vector<std::string>& candidates) {
  // A third of the letters wrong is still a typing error; more is another word.
  const std::size_t limit = std::max<std::size_t>(1, word.size() / 3);
  std::optional<std::string> best;
  std::size_t best_distance = limit + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) best = candidate, best_distance = distance;
  }
  if (best || word.size() < 3) return best;
  for (const std::string& candidate : candidates) {
    if (candidate.rfind(word, 0) == 0 || word.rfind(candidate, 0) == 0) return candidate;
  }
  return std::nullopt;
}

}  // namespace pocd::config_detail

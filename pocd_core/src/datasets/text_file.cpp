#include "text_file.hpp"

#include <charconv>
#include <cmath>
#include <fstream>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

constexpr const char* kBlanks = " \t\r,";

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words;
  std::size_t end = 0;
  for (;;) {
    const std::size_t begin = text.find_first_not_of(kBlanks, end);
    if (begin == std::string::npos) return words;
    end = std::min(text.find_first_of(kBlanks, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
  }
}

}  // namespace

std::string place(const std::filesystem::path& file, int line) {
  return file.string() + ":" + std::to_string(line);
}

std::vector<NumberedLine> read_lines(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw InputError(file.string() + ": cannot be read");
  std::vector<NumberedLine> lines;
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first != std::string::npos && text[first] != '#') lines.push_back({number, text});
  }
  return lines;
}

std::vector<double> parse_numbers(const NumberedLine& line, std::size_t count,
                                  const std::filesystem::path& file) {
  const std::vector<std::string> words = words_of(line.text);
  if (words.size() != count) {
    throw InputError(place(file, line.number) + ": has " + std::to_string(words.size()) +
                     " values, expected " + std::to_string(count));
  }
  std::vector<double> out;
  for (const std::string& word : words) {
    const char* begin = word.data() + (word[0] == '+' ? 1 : 0);
    const char* end = word.data() + word.size();
    double value = 0.0;
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (error != std::errc() || stop != end) {
      throw InputError(place(file, line.number) + ": '" + word + "' is not a number");
    }
    if (!std::isfinite(value)) {
      throw InputError(place(file, line.number) + ": '" + word + "' is not finite");
    }
    out.push_back(value);
  }
  return out;
}

std::optional<int> leading_index(const NumberedLine& line) {
  const std::vector<std::string> words = words_of(line.text);
  if (words.empty()) return std::nullopt;
  const char* const end = words[0].data() + words[0].size();
  int number = -1;
  const auto [stop, error] = std::from_chars(words[0].data(), end, number);
  if (error != std::errc() || stop != end || number < 0) return std::nullopt;
  return number;
}

Eigen::MatrixXd read_matrix(const std::filesystem::path& file, int rows, int columns) {
  const std::vector<NumberedLine> lines = read_lines(file);
  if (static_cast<int>(lines.size()) != rows) {
    throw InputError(file.string() + ": has " + std::to_string(lines.size()) + " lines, expected " +
                     std::to_string(rows));
  }
  Eigen::MatrixXd out(rows, columns);
  for (int r = 0; r < rows; ++r) {
    const std::vector<double> row =
        parse_numbers(lines[r], static_cast<std::size_t>(columns), file);
    for (int c = 0; c < columns; ++c) out(r, c) = row[c];
  }
  return out;
}

Eigen::Quaterniond read_levelling(const std::filesystem::path& folder,
                                  const std::optional<Eigen::Vector3d>& gravity_W) {
  Eigen::Vector3d down_W = gravity_W.value_or(-Eigen::Vector3d::UnitZ());
  std::string source = "option gravity";
  const std::filesystem::path file = folder / "gravity.txt";
  std::error_code unreadable;  // there is one then, and reading it says so
  if (!gravity_W && (std::filesystem::exists(file, unreadable) || unreadable)) {
    down_W = read_matrix(file, 1, 3).transpose();
    source = file.string();
  }
  if (!down_W.allFinite() || std::abs(down_W.norm() - 1.0) > 0.01) {
    throw InputError(source + ": gravity must be a unit vector, has length " +
                     std::to_string(down_W.norm()));
  }
  return Eigen::Quaterniond::FromTwoVectors(down_W, -Eigen::Vector3d::UnitZ());
}

}  // namespace pocd

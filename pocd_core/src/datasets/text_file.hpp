// Small text files of numbers, read strictly: an error names file and line.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pocd/common/types.hpp"

namespace pocd {

struct NumberedLine {
  int number = 0;  ///< from 1
  std::string text;
};

/// Lines that are neither empty nor comments (#). Throws InputError when the file cannot be read.
std::vector<NumberedLine> read_lines(const std::filesystem::path& file);

/// "file:line", which begins every error text about that line.
std::string place(const std::filesystem::path& file, int line);

/// The finite numbers of a line, exactly `count`, separated by blanks or commas. Throws InputError.
std::vector<double> parse_numbers(const NumberedLine& line, std::size_t count,
                                  const std::filesystem::path& file);

/// The whole number >= 0 that is the first word of a line, or nothing.
std::optional<int> leading_index(const NumberedLine& line);

/// A matrix of `rows` x `columns` finite numbers, a row per line. Throws InputError.
Eigen::MatrixXd read_matrix(const std::filesystem::path& file, int rows, int columns);

/// Turns the world of a folder so that gravity points along -z: `gravity_W`, or the folder's
/// gravity.txt (three numbers), or -z. Throws InputError unless it is a unit vector.
Eigen::Quaterniond read_levelling(const std::filesystem::path& folder,
                                  const std::optional<Eigen::Vector3d>& gravity_W);

}  // namespace pocd

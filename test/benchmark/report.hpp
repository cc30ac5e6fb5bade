// A table in markdown, and how numbers look in it.
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace pocd::bench {

std::string number(double value, int digits = 2);

/// Collects rows, then writes itself with a heading.
class Table {
 public:
  Table(std::string heading, std::vector<std::string> columns)
      : heading_(std::move(heading)), columns_(std::move(columns)) {}
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  void note(const std::string& line) { notes_.push_back(line); }
  void write(std::ostream& out) const;

 private:
  std::string heading_;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::string> notes_;
};

}  // namespace pocd::bench

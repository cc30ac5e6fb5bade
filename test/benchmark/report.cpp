#include "report.hpp"

#include <cstdio>

namespace pocd::bench {

std::string number(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

void Table::write(std::ostream& out) const {
  const auto line = [&](const std::vector<std::string>& cells) {
    out << "|";
    for (const std::string& cell : cells) out << " " << cell << " |";
    out << "\n";
  };
  out << "### " << heading_ << "\n\n";
  line(columns_);
  out << "|---|";
  for (std::size_t i = 1; i < columns_.size(); ++i) out << "---:|";
  out << "\n";
  for (const auto& row : rows_) line(row);
  out << "\n";
  for (const std::string& text : notes_) out << text << "\n";
  if (!notes_.empty()) out << "\n";
}

}  // namespace pocd::bench

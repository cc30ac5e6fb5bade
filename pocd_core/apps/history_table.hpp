// Rows of the history as CSV or JSON on the standard output.
#pragma once

#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include "pocd/common/enum_words.hpp"
#include "pocd/memory/history.hpp"

namespace pocd {

enum class TableFormat { kCsv, kJson };
inline EnumWords<TableFormat> words_of(TableFormat) {
  return {{TableFormat::kCsv, "csv"}, {TableFormat::kJson, "json"}};
}

/// A row is a list of (column, value); a value that is a number is given as one.
class HistoryTable {
 public:
  HistoryTable(std::ostream& out, TableFormat format) : out_(out), format_(format) {}
  /// Ends the list.
  ~HistoryTable();
  HistoryTable(const HistoryTable&) = delete;
  HistoryTable& operator=(const HistoryTable&) = delete;

  /// `kind`: of the event, or of the difference.
  void row(const std::string& kind, const LoggedEvent& logged, const std::string& class_name,
           const std::optional<OrientedBox>& before);

 private:
  struct Cell {
    const char* name;
    std::string text;
    bool is_text;
  };
  void write(const std::vector<Cell>& cells);

  std::ostream& out_;
  TableFormat format_;
  bool first_ = true;
};

/// Nanoseconds, seconds with a decimal point, or UTC as 2026-11-29T02:00:00Z. Throws InputError.
StampNs parse_time(const std::string& text);

}  // namespace pocd

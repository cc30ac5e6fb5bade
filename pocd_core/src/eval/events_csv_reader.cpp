#include <charconv>
#include <cmath>
#include <fstream>

#include "pocd/common/check.hpp"
#include "pocd/eval/change_report.hpp"

namespace pocd {
namespace {

/// The cells of one line; a quoted cell may hold separators and doubled quotes, not line breaks.
std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += c;
      ++i;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

class Row {
 public:
  Row(const std::vector<std::string>& header, std::vector<std::string> cells, std::string where)
      : header_(header), cells_(std::move(cells)), where_(std::move(where)) {
    if (cells_.size() != header_.size()) {
      throw InputError(where_ + ": " + std::to_string(cells_.size()) + " cells, the header has " +
                       std::to_string(header_.size()));
    }
  }

  const std::string& text(const std::string& column) const {
    for (std::size_t i = 0; i < header_.size(); ++i) {
      if (header_[i] == column) return cells_[i];
    }
    throw InputError(where_ + ": no column " + column);
  }

  double number(const std::string& column) const {
    const auto value = parse<double>(column);
    if (value && std::isfinite(*value)) return *value;
    throw InputError(where_ + ": " + column + " \"" + text(column) + "\" is no number");
  }

  std::uint32_t id(const std::string& column) const {
    if (const auto value = parse<std::uint32_t>(column)) return *value;
    throw InputError(where_ + ": " + column + " \"" + text(column) +
                     "\" is no whole number of 32 bits");
  }

  Eigen::Vector3d position(const std::string& prefix) const {
    return {number(prefix + "x"), number(prefix + "y"), number(prefix + "z")};
  }

  EventKind kind() const {
    const std::string& word = text("kind");
    for (const EventKind kind : {EventKind::kAdded, EventKind::kUpdated, EventKind::kMoved,
                                 EventKind::kRemoved, EventKind::kOperator}) {
      if (word == to_string(kind)) return kind;
    }
    throw InputError(where_ + ": kind \"" + word + "\" is unknown");
  }

 private:
  /// The value of a whole cell.
  template <class T>
  std::optional<T> parse(const std::string& column) const {
    const std::string& cell = text(column);
    const char* const end = cell.data() + cell.size();
    T value{};
    const auto [stop, error] = std::from_chars(cell.data(), end, value);
    return error == std::errc() && stop == end ? std::optional<T>(value) : std::nullopt;
  }

  const std::vector<std::string>& header_;
  std::vector<std::string> cells_;
  std::string where_;
};

}  // namespace

std::vector<ReportedEvent> read_events_csv(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line)) throw InputError(file.string() + ": cannot be read or is empty");
  const std::vector<std::string> header = split(line);
  std::vector<ReportedEvent> events;
  for (int number = 2; std::getline(in, line); ++number) {
    const Row row(header, split(line), file.string() + ":" + std::to_string(number));
    ReportedEvent event;
    event.kind = row.kind();
    event.object = row.id("object_id");
    event.class_name = row.text("class_name");
    event.position_W = row.position("");
    if (!row.text("previous_x").empty()) event.previous_W = row.position("previous_");
    if (!row.text("absorbed").empty()) event.absorbed = row.id("absorbed");
    events.push_back(event);
  }
  return events;
}

}  // namespace pocd

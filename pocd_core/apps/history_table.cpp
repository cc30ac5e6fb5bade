#include "history_table.hpp"

#include <time.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <ostream>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

std::string number(double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return std::isfinite(value) ? text.data() : "";
}

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c == '\r' || c == '\n' ? ' ' : c;
  }
  return out + '"';
}

std::string json_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (u < 0x20) {
      std::array<char, 8> code{};
      std::snprintf(code.data(), code.size(), "\\u%04x", u);
      out += code.data();
    } else {
      out += c;
    }
  }
  return out + '"';
}

}  // namespace

HistoryTable::~HistoryTable() {
  if (format_ == TableFormat::kJson) out_ << (first_ ? "[]\n" : "\n]\n");
}

void HistoryTable::write(const std::vector<Cell>& cells) {
  if (format_ == TableFormat::kCsv) {
    for (std::size_t i = 0; first_ && i < cells.size(); ++i) {
      out_ << (i > 0 ? "," : "") << cells[i].name;
    }
    if (first_) out_ << '\n';
    for (std::size_t i = 0; i < cells.size(); ++i) {
      out_ << (i > 0 ? "," : "") << csv_text(cells[i].text);
    }
    out_ << '\n';
  } else {
    out_ << (first_ ? "[\n" : ",\n") << " {";
    bool any = false;
    for (const Cell& cell : cells) {
      if (cell.text.empty() && !cell.is_text) continue;  // nothing known
      out_ << (any ? ", " : "") << json_text(cell.name) << ": "
           << (cell.is_text ? json_text(cell.text) : cell.text);
      any = true;
    }
    out_ << "}";
  }
  first_ = false;
}

void HistoryTable::row(const std::string& kind, const LoggedEvent& logged,
                       const std::string& class_name, const std::optional<OrientedBox>& before) {
  const ObjectEvent& e = logged.event;
  const Eigen::Vector3d &p = e.box.pose.position_W, &s = e.box.size_m;
  const auto place = [&](int axis) {
    return before ? number(before->pose.position_W[axis]) : std::string();
  };
  write({{"sequence", std::to_string(e.sequence), false},
         {"run", std::to_string(logged.run), false},
         {"stamp_ns", std::to_string(e.stamp_ns), false},
         {"kind", kind, true},
         {"object_id", std::to_string(to_index(e.object)), false},
         {"class", std::to_string(e.class_id), false},
         {"class_name", class_name, true},
         {"robot", e.robot, true},
         {"x", number(p.x()), false},
         {"y", number(p.y()), false},
         {"z", number(p.z()), false},
         {"yaw", number(e.box.pose.yaw_rad), false},
         {"size_x", number(s.x()), false},
         {"size_y", number(s.y()), false},
         {"size_z", number(s.z()), false},
         {"previous_x", place(0), false},
         {"previous_y", place(1), false},
         {"previous_z", place(2), false},
         {"absorbed", e.absorbed ? std::to_string(to_index(*e.absorbed)) : "", false},
         {"last_there_ns", e.last_there_ns != 0 ? std::to_string(e.last_there_ns) : "", false},
         {"first_gone_ns", e.first_gone_ns != 0 ? std::to_string(e.first_gone_ns) : "", false},
         {"by", e.by, true},
         {"rule", e.evidence.rule, true},
         {"delta", number(e.evidence.delta_m), false},
         {"visible_share", number(e.evidence.visible_share), false},
         {"seen_through_share", number(e.evidence.seen_through_share), false},
         {"stationarity_before", number(e.evidence.before.stationarity()), false},
         {"stationarity_after", number(e.evidence.after.stationarity()), false},
         {"arrival", e.kind == EventKind::kAdded ? to_string(e.arrival) : "", true}});
}

StampNs parse_time(const std::string& text) {
  const InputError wrong("\"" + text +
                         "\" is no time: nanoseconds, seconds with a decimal point, or UTC as "
                         "2026-11-29T02:00:00Z");
  if (text.find('T') != std::string::npos) {
    tm parts{};
    const char* end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
    if (end == nullptr || *end != '\0') throw wrong;
    return static_cast<StampNs>(timegm(&parts)) * 1'000'000'000;
  }
  char* end = nullptr;
  if (text.find('.') != std::string::npos) {
    const double seconds = std::strtod(text.c_str(), &end);
    if (end == text.c_str() || *end != '\0' || !(std::abs(seconds) < 9e9)) throw wrong;
    return static_cast<StampNs>(std::llround(seconds * 1e9));
  }
  errno = 0;
  const long long ns = std::strtoll(text.c_str(), &end, 10);
  if (end == text.c_str() || *end != '\0' || errno != 0) throw wrong;
  return ns;
}

}  // namespace pocd

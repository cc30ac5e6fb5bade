#include "pocd/eval/expected_changes.hpp"

#include <cmath>
#include <cstdio>

namespace pocd {
namespace {

std::string describe_expected(const ExpectedChange& change) {
  char text[160];
  if (change.kind == EventKind::kMoved) {
    std::snprintf(text, sizeof text, " (%.2f, %.2f) -> (%.2f, %.2f) within %.2f m", change.from_x_m,
                  change.from_y_m, change.x_m, change.y_m, change.within_m);
  } else {
    std::snprintf(text, sizeof text, " (%.2f, %.2f) within %.2f m", change.x_m, change.y_m,
                  change.within_m);
  }
  return word_of(change.kind) + (change.class_name.empty() ? "" : " " + change.class_name) + text;
}

bool fulfils(const ReportedEvent& event, const ExpectedChange& change) {
  const auto near = [&](const Eigen::Vector3d& place, double x_m, double y_m) {
    return std::hypot(place.x() - x_m, place.y() - y_m) <= change.within_m;
  };
  return event.kind == change.kind &&
         (change.class_name.empty() || change.class_name == event.class_name) &&
         near(event.position_W, change.x_m, change.y_m) &&
         (event.kind != EventKind::kMoved ||
          (event.previous_W && near(*event.previous_W, change.from_x_m, change.from_y_m)));
}

}  // namespace

std::vector<std::string> disappointments(const ExpectedChanges& expected,
                                         const std::vector<ReportedEvent>& events) {
  std::vector<std::string> lines;
  const std::vector<ReportedEvent> last_word = last_words(events);
  std::vector<bool> claimed(last_word.size(), false);
  for (const ExpectedChange& change : expected.changes) {
    bool found = false;
    for (std::size_t i = 0; i < last_word.size() && !found; ++i) {
      if (claimed[i] || !fulfils(last_word[i], change)) continue;
      claimed[i] = found = true;
    }
    if (!found) lines.push_back("expected and not reported: " + describe_expected(change));
  }
  for (std::size_t i = 0; i < last_word.size(); ++i) {
    const EventKind kind = last_word[i].kind;
    if (claimed[i] || kind == EventKind::kUpdated || expected.others == OtherReports::kAny ||
        (expected.others == OtherReports::kAdded && kind == EventKind::kAdded)) {
      continue;
    }
    lines.push_back("reported and not expected: " + describe(last_word[i]));
  }
  return lines;
}

}  // namespace pocd

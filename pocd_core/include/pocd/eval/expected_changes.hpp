// What a run is expected to report, and whether it did: for tests of a whole site.
#pragma once

#include <string>
#include <vector>

#include "pocd/common/describe.hpp"
#include "pocd/eval/change_report.hpp"

namespace pocd {

/// Those that can be expected.
inline EnumWords<EventKind> words_of(EventKind) {
  return {
      {EventKind::kAdded, "ADDED"}, {EventKind::kMoved, "MOVED"}, {EventKind::kRemoved, "REMOVED"}};
}

/// What may be reported beside what is expected.
enum class OtherReports {
  kAny,    ///< anything
  kAdded,  ///< ADDED: what stood there from the start
  kNone,   ///< nothing
};
inline EnumWords<OtherReports> words_of(OtherReports) {
  return {
      {OtherReports::kAny, "any"}, {OtherReports::kAdded, "added"}, {OtherReports::kNone, "none"}};
}

/// One report that has to come. Places are of the box, on the ground, map frame.
struct ExpectedChange {
  EventKind kind = EventKind::kAdded;
  std::string class_name;
  double x_m = 0.0, y_m = 0.0;
  double from_x_m = 0.0, from_y_m = 0.0;  ///< MOVED only
  double within_m = 0.6;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("kind", kind, "What is reported.");
    visit("class_name", class_name, "Of the object; empty: any.");
    visit("x_m", x_m, Range{-100'000, 100'000}, "Where it is now, REMOVED: was [m].");
    visit("y_m", y_m, Range{-100'000, 100'000}, "Where it is now, REMOVED: was [m].");
    visit("from_x_m", from_x_m, Range{-100'000, 100'000}, "MOVED: where it was [m].");
    visit("from_y_m", from_y_m, Range{-100'000, 100'000}, "MOVED: where it was [m].");
    visit("within_m", within_m, Range{0.01, 100.0}, "How far the report may be from there [m].");
  }
};

/// The file of pocd_expect.
struct ExpectedChanges {
  std::vector<ExpectedChange> changes;
  OtherReports others = OtherReports::kAdded;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("changes", changes, "What has to be reported, each by an event of its own.");
    visit("others", others,
          "What else may be reported: anything, only ADDED (what stood there from the start), or "
          "nothing.");
  }
};

/// Compares the last word of the events, without what a later MOVED takes back. One line for each
/// expectation that no event fulfils and each event that may not be; empty: all is as expected.
std::vector<std::string> disappointments(const ExpectedChanges& expected,
                                         const std::vector<ReportedEvent>& events);

}  // namespace pocd

// What really changed in a simulated run beside what the system reported, as a table for people.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pocd/objects/frame_result.hpp"
#include "pocd/sim/truth.hpp"

namespace pocd {

/// The part of an ObjectEvent that a report needs.
struct ReportedEvent {
  EventKind kind = EventKind::kAdded;
  std::uint32_t object = 0;
  std::string class_name;
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> previous_W;  ///< MOVED: where it was
  std::optional<std::uint32_t> absorbed;      ///< id that turned out to be this object
};

/// Reads what EventsCsv wrote, in order. Throws InputError naming file, line and column.
std::vector<ReportedEvent> read_events_csv(const std::filesystem::path& file);

/// One line: "MOVED box #4 (1.00, 2.00) -> (1.50, 2.00)".
std::string describe(const ReportedEvent& event);

/// What the events say in the end: without an ADDED or REMOVED that a later MOVED takes back.
std::vector<ReportedEvent> last_words(const std::vector<ReportedEvent>& events);

struct ChangeRow {
  std::string visit, truth, reported;
  bool right = false;
};

/// `rows`: one per object of the first visit and per later change. `false_reports`: ADDED, MOVED
/// and REMOVED that belong to none of them.
struct ChangeReport {
  std::vector<ChangeRow> rows;
  std::vector<std::string> false_reports;
  std::size_t changes = 0;        ///< rows after the first visit
  std::size_t right_changes = 0;  ///< of those
};

/// A truth is rightly reported by the first unused event of its kind whose place is within
/// `radius_m` horizontally of the true one (MOVED: both places). For the others the row shows one
/// unused event of any kind near by (two for a move, so REMOVED and ADDED), which does not make it
/// right.
ChangeReport compare_changes(const Scenario& scenario, const std::vector<ReportedEvent>& events,
                             double radius_m);

std::string format_report(const ChangeReport& report);

}  // namespace pocd

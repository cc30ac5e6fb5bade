#include "pocd/output/change_report.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <sstream>

namespace pocd {
namespace {

std::string place(const Eigen::Vector3d& p) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "(%.2f, %.2f)", p.x(), p.y());
  return text.data();
}

std::string describe(const ReportedEvent& event) {
  std::string text = std::string(to_string(event.kind)) + " " + event.class_name + " #" +
                     std::to_string(event.object) + " ";
  if (event.previous_W) text += place(*event.previous_W) + " -> ";
  return text + place(event.position_W);
}

/// Events that no truth has claimed yet.
class Unclaimed {
 public:
  Unclaimed(const std::vector<ReportedEvent>& events, double radius_m)
      : events_(events), claimed_(events.size(), false), radius_m_(radius_m) {}

  const ReportedEvent* claim(EventKind kind, const OrientedBox* before, const OrientedBox& box) {
    for (std::size_t i = 0; i < events_.size(); ++i) {
      const ReportedEvent& event = events_[i];
      if (claimed_[i] || event.kind != kind || !near(event.position_W, box)) continue;
      if (before && !(event.previous_W && near(*event.previous_W, *before))) continue;
      claimed_[i] = true;
      return &event;
    }
    return nullptr;
  }

  std::vector<std::string> rest() const {
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < events_.size(); ++i) {
      const bool is_change = events_[i].kind != EventKind::kUpdated;
      if (is_change && !claimed_[i]) lines.push_back(describe(events_[i]));
    }
    return lines;
  }

 private:
  bool near(const Eigen::Vector3d& position_W, const OrientedBox& box) const {
    return (position_W - box.pose.position_W).head<2>().norm() <= radius_m_;
  }

  const std::vector<ReportedEvent>& events_;
  std::vector<bool> claimed_;
  double radius_m_;
};

ChangeRow compare(const std::string& visit, const TruthChange& change, Unclaimed& events) {
  ChangeRow row;
  row.visit = visit;
  row.truth = std::string(to_string(change.kind)) + " " + change.name + " ";
  const ReportedEvent* event = nullptr;
  switch (change.kind) {
    case ChangeKind::kAdded:
      row.truth += place(change.after->pose.position_W);
      event = events.claim(EventKind::kAdded, nullptr, *change.after);
      break;
    case ChangeKind::kRemoved:
      row.truth += place(change.before->pose.position_W);
      event = events.claim(EventKind::kRemoved, nullptr, *change.before);
      break;
    case ChangeKind::kMoved: {
      row.truth +=
          place(change.before->pose.position_W) + " -> " + place(change.after->pose.position_W);
      event = events.claim(EventKind::kMoved, &*change.before, *change.after);
      if (event) break;
      const ReportedEvent* gone = events.claim(EventKind::kRemoved, nullptr, *change.before);
      const ReportedEvent* come = events.claim(EventKind::kAdded, nullptr, *change.after);
      if (gone) row.reported = describe(*gone);
      if (come) row.reported += (gone ? ", " : "") + describe(*come);
      break;
    }
  }
  if (event) row.reported = describe(*event), row.right = true;
  return row;
}

}  // namespace

ChangeReport compare_changes(const Scenario& scenario, const std::vector<ReportedEvent>& events,
                             double radius_m) {
  ChangeReport report;
  Unclaimed unclaimed(events, radius_m);
  for (const TruthObject& object : objects_after(scenario, 0)) {
    TruthChange first;
    first.name = object.name;
    first.after = object.box;
    report.rows.push_back(compare(scenario.visits[0].name, first, unclaimed));
  }
  const std::size_t first_changes = report.rows.size();
  for (std::size_t visit = 1; visit < scenario.visits.size(); ++visit) {
    for (const TruthChange& change : changes_of(scenario, visit)) {
      report.rows.push_back(compare(scenario.visits[visit].name, change, unclaimed));
    }
  }
  report.changes = report.rows.size() - first_changes;
  report.right_changes = static_cast<std::size_t>(
      std::count_if(report.rows.begin() + static_cast<std::ptrdiff_t>(first_changes),
                    report.rows.end(), [](const ChangeRow& row) { return row.right; }));
  report.false_reports = unclaimed.rest();
  return report;
}

std::string format_report(const ChangeReport& report) {
  const std::string truth_title = "what really changed";
  std::size_t visit_width = 5, truth_width = truth_title.size();
  for (const ChangeRow& row : report.rows) {
    visit_width = std::max(visit_width, row.visit.size());
    truth_width = std::max(truth_width, row.truth.size());
  }
  std::ostringstream out;
  const auto line = [&](std::string visit, std::string truth, const std::string& reported,
                        const std::string& mark) {
    visit.resize(visit_width, ' ');
    truth.resize(truth_width, ' ');
    out << visit << "  " << truth << "  " << mark << "  " << reported << '\n';
  };
  line("visit", truth_title, "what the system said", "  ");
  for (const ChangeRow& row : report.rows) {
    line(row.visit, row.truth, row.reported.empty() ? "nothing" : row.reported,
         row.right ? "ok" : "--");
  }
  for (const std::string& event : report.false_reports) line("", "nothing", event, "--");
  out << report.right_changes << " of " << report.changes << " changes reported, "
      << report.false_reports.size() << " reports without a change\n";
  return out.str();
}

}  // namespace pocd

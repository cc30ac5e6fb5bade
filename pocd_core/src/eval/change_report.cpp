#include "pocd/eval/change_report.hpp"

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

}  // namespace

std::string describe(const ReportedEvent& event) {
  std::string text = std::string(to_string(event.kind)) + " " + event.class_name + " #" +
                     std::to_string(event.object) + " ";
  if (event.previous_W) text += place(*event.previous_W) + " -> ";
  return text + place(event.position_W);
}

namespace {

/// Events that no truth has claimed yet.
class Unclaimed {
 public:
  Unclaimed(const std::vector<ReportedEvent>& events, double radius_m)
      : events_(events), claimed_(events.size(), false), radius_m_(radius_m) {}

  /// The first one that says exactly what the truth is.
  const ReportedEvent* claim(const TruthChange& truth) {
    return claim_if([&](const ReportedEvent& event) { return says(event, truth); });
  }

  /// The first one of any kind that is about one of the truth's places.
  const ReportedEvent* claim_nearby(const TruthChange& truth) {
    return claim_if([&](const ReportedEvent& event) {
      return near(event.position_W, truth.before) || near(event.position_W, truth.after);
    });
  }

  std::vector<std::string> rest() {
    std::vector<std::string> lines;
    const auto any = [](const ReportedEvent&) { return true; };
    while (const ReportedEvent* event = claim_if(any)) lines.push_back(describe(*event));
    return lines;
  }

 private:
  template <class Condition>
  const ReportedEvent* claim_if(const Condition& condition) {
    for (std::size_t i = 0; i < events_.size(); ++i) {
      if (claimed_[i] || events_[i].kind == EventKind::kUpdated || !condition(events_[i])) continue;
      claimed_[i] = true;
      return &events_[i];
    }
    return nullptr;
  }

  bool near(const Eigen::Vector3d& position_W, const std::optional<OrientedBox>& box) const {
    return box && (position_W - box->pose.position_W).head<2>().norm() <= radius_m_;
  }

  bool says(const ReportedEvent& event, const TruthChange& truth) const {
    switch (truth.kind) {
      case ChangeKind::kAdded:
        return event.kind == EventKind::kAdded && near(event.position_W, truth.after);
      case ChangeKind::kRemoved:
        return event.kind == EventKind::kRemoved && near(event.position_W, truth.before);
      case ChangeKind::kMoved:
        return event.kind == EventKind::kMoved && near(event.position_W, truth.after) &&
               event.previous_W && near(*event.previous_W, truth.before);
    }
    return false;
  }

  const std::vector<ReportedEvent>& events_;
  std::vector<bool> claimed_;
  double radius_m_;
};

struct Truth {
  std::string visit;
  TruthChange change;
};

/// The objects of the first visit as additions, then every change.
std::vector<Truth> truths_of(const Scenario& scenario) {
  std::vector<Truth> truths;
  for (const TruthObject& object : objects_after(scenario, 0)) {
    TruthChange first;
    first.name = object.name;
    first.after = object.box;
    truths.push_back({scenario.visits[0].name, first});
  }
  for (std::size_t visit = 1; visit < scenario.visits.size(); ++visit) {
    for (const TruthChange& change : changes_of(scenario, visit)) {
      truths.push_back({scenario.visits[visit].name, change});
    }
  }
  return truths;
}

std::string describe(const TruthChange& change) {
  std::string text = std::string(to_string(change.kind)) + " " + change.name + " ";
  if (change.before) text += place(change.before->pose.position_W);
  if (change.before && change.after) text += " -> ";
  if (change.after) text += place(change.after->pose.position_W);
  return text;
}

}  // namespace

std::vector<ReportedEvent> last_words(const std::vector<ReportedEvent>& events) {
  std::vector<ReportedEvent> kept;
  for (const ReportedEvent& event : events) {
    const auto taken_back = [&](const ReportedEvent& earlier) {
      const bool same_thing = event.absorbed && earlier.object == *event.absorbed;
      return (earlier.kind == EventKind::kAdded && same_thing) ||
             (earlier.kind == EventKind::kRemoved && event.kind == EventKind::kMoved &&
              earlier.object == event.object);
    };
    kept.erase(std::remove_if(kept.begin(), kept.end(), taken_back), kept.end());
    kept.push_back(event);
  }
  return kept;
}

ChangeReport compare_changes(const Scenario& scenario, const std::vector<ReportedEvent>& events,
                             double radius_m) {
  const std::vector<Truth> truths = truths_of(scenario);
  const std::vector<ReportedEvent> last_word = last_words(events);
  Unclaimed unclaimed(last_word, radius_m);
  ChangeReport report;
  for (const Truth& truth : truths) {
    ChangeRow row{truth.visit, describe(truth.change), "", false};
    if (const ReportedEvent* event = unclaimed.claim(truth.change)) {
      row.reported = describe(*event);
      row.right = true;
    }
    report.rows.push_back(row);
  }
  // Only now: what is not exactly right must not take an event that is right about another truth.
  for (std::size_t i = 0; i < truths.size(); ++i) {
    ChangeRow& row = report.rows[i];
    const bool is_move = truths[i].change.kind == ChangeKind::kMoved;
    for (int left = row.right ? 0 : is_move ? 2 : 1; left > 0; --left) {
      const ReportedEvent* event = unclaimed.claim_nearby(truths[i].change);
      if (event) row.reported += (row.reported.empty() ? "" : ", ") + describe(*event);
    }
  }
  report.false_reports = unclaimed.rest();
  const std::size_t first_visit = objects_after(scenario, 0).size();
  report.changes = report.rows.size() - first_visit;
  for (std::size_t i = first_visit; i < report.rows.size(); ++i) {
    report.right_changes += report.rows[i].right ? 1 : 0;
  }
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

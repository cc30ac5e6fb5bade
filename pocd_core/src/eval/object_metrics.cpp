#include "pocd/eval/object_metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "pocd/eval/place_match.hpp"
#include "pocd/segmentation/observations.hpp"

namespace pocd {
namespace {

bool right_move(const NetChange& net, const TruthChange& change, double tolerance_m) {
  if (!net.before || !net.after || !change.before || !change.after) return false;
  if (!same_place(*net.before, *change.before, tolerance_m) ||
      !same_place(*net.after, *change.after, tolerance_m)) {
    return false;
  }
  const Eigen::Vector2d said = (net.after->pose.position_W - net.before->pose.position_W).head<2>();
  const Eigen::Vector2d was =
      (change.after->pose.position_W - change.before->pose.position_W).head<2>();
  // Growth of a partial view moves a box's centre by a few decimetres.
  return (said - was).norm() <= std::max(2.5 * tolerance_m, 0.5 * was.norm());
}

bool exact(const NetChange& net, const TruthChange& change, double tolerance_m) {
  if (net.kind != change.kind) return false;
  switch (change.kind) {
    case ChangeKind::kAdded:
      return same_place(*net.after, *change.after, tolerance_m);
    case ChangeKind::kRemoved:
      return same_place(*net.before, *change.before, tolerance_m);
    case ChangeKind::kMoved:
      return right_move(net, change, tolerance_m);
  }
  return false;
}

bool says_gone(const NetChange& net, const TruthChange& change, double tolerance_m) {
  return net.before && change.before && same_place(*net.before, *change.before, tolerance_m);
}
bool says_new(const NetChange& net, const TruthChange& change, double tolerance_m) {
  return net.after && change.after && same_place(*net.after, *change.after, tolerance_m);
}

/// The net change of one object's events in order.
std::optional<NetChange> net_of(const std::vector<const RunEvents::Timed*>& events) {
  NetChange net;
  std::optional<OrientedBox> before, after;
  bool first = true;
  for (const RunEvents::Timed* timed : events) {
    const ObjectEvent& event = timed->event;
    if (event.kind == EventKind::kUpdated) {
      if (after) after = event.box;
      continue;
    }
    if (first) {
      if (event.kind == EventKind::kMoved)
        before = event.previous_box ? event.previous_box : event.box;
      if (event.kind == EventKind::kRemoved) before = event.box;
      first = false;
    }
    after = event.kind == EventKind::kRemoved ? std::nullopt : std::make_optional(event.box);
    net.frame = timed->frame;
    net.object = event.object;
  }
  if (first) return std::nullopt;
  net.before = before, net.after = after;
  if (before && after) {
    net.kind = ChangeKind::kMoved;
  } else if (after) {
    net.kind = ChangeKind::kAdded;
  } else {
    net.kind = ChangeKind::kRemoved;  // without `before`: came and went within the visit
  }
  return net;
}

using EventsByObject = std::map<ObjectId, std::vector<const RunEvents::Timed*>>;

EventsByObject by_object(const RunEvents& run, std::size_t begin, std::size_t end) {
  EventsByObject out;
  for (const RunEvents::Timed& timed : run.events) {
    if (timed.frame >= begin && timed.frame < end) out[timed.event.object].push_back(&timed);
  }
  return out;
}

class VisitJudge {
 public:
  VisitJudge(const RunEvents& run, const SceneTruth& truth, std::size_t visit)
      : run_(run),
        truth_(truth),
        tolerance_m_(truth.place_tolerance_m),
        visit_(visit),
        begin_(truth.visit_begin[visit]),
        end_(truth.visit_begin[visit + 1]),
        nets_(net_changes(run, begin_, end_)) {}

  void judge(ObjectScore& score) {
    for (const SeenChange& seen : truth_.changes) {
      if (seen.visit == visit_) judge_truth(seen, score);
    }
    for (const NetChange& net : nets_) judge_net(net, score);
  }

 private:
  void judge_truth(const SeenChange& seen, ObjectScore& score) const {
    if (!seen.clear_frame()) {
      ++score.unseen_changes;
      return;
    }
    ObjectScore::Found found{seen, false, false, std::nullopt};
    bool gone = !seen.change.before || !seen.old_place_frame,
         arrived = !seen.change.after || !seen.new_place_frame;
    for (const NetChange& net : nets_) {
      gone = gone || says_gone(net, seen.change, tolerance_m_);
      arrived = arrived || says_new(net, seen.change, tolerance_m_);
      if (!exact(net, seen.change, tolerance_m_)) continue;
      found.exact = true;
      const std::size_t frame = first_said(net.object, seen.change);
      if (!found.exact_frame || frame < *found.exact_frame) found.exact_frame = frame;
    }
    judge_parts(seen.change, found);
    found.place = found.exact || (gone && arrived);
    score.changes.push_back(std::move(found));
  }

  /// A thing within an object that holds several touching ones is removed or added by an UPDATED
  /// event after which the object's box has lost or gained the thing's place.
  void judge_parts(const TruthChange& change, ObjectScore::Found& found) const {
    if (found.exact || change.kind == ChangeKind::kMoved) return;
    for (const ObjectSnapshot& object : run_.objects_at_visit_begin[visit_]) {
      for (const RunEvents::Timed& timed : run_.events) {
        if (timed.frame < begin_ || timed.frame >= end_ || timed.event.object != object.id ||
            timed.event.kind != EventKind::kUpdated) {
          continue;
        }
        const OrientedBox& place = change.before ? *change.before : *change.after;
        const bool held = covers(object.box, place, tolerance_m_),
                   holds = covers(timed.event.box, place, tolerance_m_);
        if (change.kind == ChangeKind::kRemoved ? held && !holds : !held && holds) {
          found.exact = true;
          found.exact_frame = timed.frame;
          return;
        }
      }
    }
  }

  /// First frame after which the events about the object say what happened.
  std::size_t first_said(ObjectId id, const TruthChange& change) const {
    const auto events = by_object(run_, begin_, end_).at(id);
    for (std::size_t n = 1; n <= events.size(); ++n) {
      const auto net = net_of({events.begin(), events.begin() + static_cast<std::ptrdiff_t>(n)});
      if (net && exact(*net, change, tolerance_m_)) return events[n - 1]->frame;
    }
    return events.back()->frame;
  }

  void judge_net(const NetChange& net, ObjectScore& score) const {
    const NetVerdict verdict = verdict_of(net);
    score.false_changes += verdict == NetVerdict::kFalse && net.kind != ChangeKind::kAdded;
    score.nets.emplace_back(net, verdict);
  }

  NetVerdict verdict_of(const NetChange& net) const {
    if (!net.before && !net.after) return NetVerdict::kFalse;
    bool partial = false;
    for (const SeenChange& seen : truth_.changes) {
      if (seen.visit != visit_) continue;
      if (exact(net, seen.change, tolerance_m_)) return NetVerdict::kRight;
      partial = partial || says_gone(net, seen.change, tolerance_m_) ||
                says_new(net, seen.change, tolerance_m_);
    }
    if (net.kind == ChangeKind::kRemoved && superseded(net)) return NetVerdict::kNeutral;
    if (partial) return NetVerdict::kPartial;
    if (net.kind == ChangeKind::kAdded && discovery(net)) return NetVerdict::kNeutral;
    return NetVerdict::kFalse;
  }

  /// Another object's move starts here: the thing went on under another id.
  bool superseded(const NetChange& net) const {
    return std::any_of(nets_.begin(), nets_.end(), [&](const NetChange& other) {
      return other.object != net.object && other.kind == ChangeKind::kMoved &&
             box_overlap(*other.before, *net.before, tolerance_m_) >= 0.8;
    });
  }

  /// A thing that is there and that nothing in the library stood for when the visit began.
  bool discovery(const NetChange& net) const {
    const auto& things = truth_.objects[visit_];
    const bool there = std::any_of(things.begin(), things.end(), [&](const TruthObject& thing) {
      return same_place(*net.after, thing.box, tolerance_m_);
    });
    const auto& held = run_.objects_at_visit_begin[visit_];
    const bool known = std::any_of(held.begin(), held.end(), [&](const ObjectSnapshot& object) {
      return box_overlap(object.box, *net.after, tolerance_m_) >= 0.5;
    });
    return there && (visit_ == 0 || !known);
  }

  const RunEvents& run_;
  const SceneTruth& truth_;
  double tolerance_m_;
  std::size_t visit_, begin_, end_;
  std::vector<NetChange> nets_;
};

double share(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                   : std::numeric_limits<double>::quiet_NaN();
}

double harmonic(double p, double r) {
  if (std::isnan(p)) return std::isnan(r) ? p : 0.0;  // said nothing, missed all
  if (std::isnan(r)) return 0.0;                      // nothing happened, said something
  return p + r > 0.0 ? 2.0 * p * r / (p + r) : 0.0;
}

}  // namespace

std::vector<NetChange> net_changes(const RunEvents& run, std::size_t first_frame,
                                   std::size_t end_frame) {
  std::vector<NetChange> nets;
  std::set<ObjectId> absorbed;
  for (const RunEvents::Timed& timed : run.events) {
    if (timed.frame >= first_frame && timed.frame < end_frame && timed.event.absorbed)
      absorbed.insert(*timed.event.absorbed);
  }
  for (const auto& [id, events] : by_object(run, first_frame, end_frame)) {
    if (absorbed.count(id) > 0) continue;  // its events went on under another id
    if (const auto net = net_of(events)) nets.push_back(*net);
  }
  return nets;
}

ObjectScore score_objects(const RunEvents& run, const SceneTruth& truth) {
  ObjectScore score;
  for (std::size_t visit = 0; visit + 1 < truth.visit_begin.size(); ++visit) {
    VisitJudge(run, truth, visit).judge(score);
  }
  return score;
}

ObjectScore merge(const std::vector<ObjectScore>& scores) {
  ObjectScore sum;
  for (const ObjectScore& score : scores) {
    sum.changes.insert(sum.changes.end(), score.changes.begin(), score.changes.end());
    sum.nets.insert(sum.nets.end(), score.nets.begin(), score.nets.end());
    sum.unseen_changes += score.unseen_changes;
    sum.false_changes += score.false_changes;
  }
  return sum;
}

double ObjectScore::precision(std::optional<ChangeKind> kind) const {
  std::size_t right = 0, counted = 0;
  for (const auto& [net, verdict] : nets) {
    if ((kind && net.kind != *kind) || verdict == NetVerdict::kNeutral) continue;
    ++counted;
    right += verdict == NetVerdict::kRight;
  }
  return share(right, counted);
}

double ObjectScore::recall(std::optional<ChangeKind> kind) const {
  std::size_t right = 0, counted = 0;
  for (const Found& found : changes) {
    if (kind && found.truth.change.kind != *kind) continue;
    ++counted;
    right += found.exact;
  }
  return share(right, counted);
}

double ObjectScore::f1(std::optional<ChangeKind> kind) const {
  return harmonic(precision(kind), recall(kind));
}

double ObjectScore::place_f1() const {
  std::size_t right = 0, counted = 0, found = 0;
  for (const auto& [net, verdict] : nets) {
    if (verdict == NetVerdict::kNeutral) continue;
    ++counted;
    right += verdict != NetVerdict::kFalse;
  }
  for (const Found& change : changes) found += change.place;
  return harmonic(share(right, counted), share(found, changes.size()));
}

std::vector<double> ObjectScore::delays() const {
  std::vector<double> delays;
  for (const Found& found : changes) {
    if (!found.exact_frame) continue;
    const auto clear = static_cast<double>(*found.truth.clear_frame());
    delays.push_back(std::max(0.0, static_cast<double>(*found.exact_frame) - clear));
  }
  std::sort(delays.begin(), delays.end());
  return delays;
}

}  // namespace pocd

#include "pocd/memory/history.hpp"

#include <algorithm>
#include <set>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

constexpr std::size_t kPage = 1000;

void apply(const LoggedEvent& logged, HistoryState& state) {
  if (logged.event.absorbed) state.erase(*logged.event.absorbed);
  const EventKind kind = logged.event.kind;
  if (kind == EventKind::kRemoved || kind == EventKind::kOperator) {
    state.erase(logged.event.object);
  } else {
    state[logged.event.object] = logged;
  }
}

}  // namespace

const char* to_string(DifferenceKind kind) {
  static const char* const names[] = {"ADDED", "MOVED", "CHANGED", "REMOVED"};
  return names[static_cast<int>(kind)];
}

template <class Visit>
void History::for_each_event(const Visit& visit) {
  for (const LoggedEvent& logged : log_.standing()) visit(logged);
  std::uint64_t after = 0;
  while (true) {
    const std::vector<LoggedEvent> page = log_.events(after, kPage);
    for (const LoggedEvent& logged : page) {
      visit(logged);
      after = logged.event.sequence;
    }
    if (page.size() < kPage) return;
  }
}

HistoryState History::state_at(StampNs time_ns) {
  // Of what was dropped, only the last word on each object that stood is left.
  StampNs dropped_ns = 0;
  bool dropped = false;
  for (const LoggedEvent& logged : log_.standing()) {
    dropped = true;
    dropped_ns = std::max(dropped_ns, logged.event.stamp_ns);
  }
  if (dropped && time_ns < dropped_ns) {
    throw InputError("the log begins after stamp " + std::to_string(dropped_ns) +
                     ": what was before is not kept any more");
  }
  HistoryState state;
  for_each_event([&](const LoggedEvent& logged) {
    if (logged.event.stamp_ns <= time_ns) apply(logged, state);
  });
  return state;
}

std::vector<Difference> History::between(StampNs from_ns, StampNs to_ns, double least_m) {
  if (to_ns < from_ns) throw InputError("the second time lies before the first");
  const HistoryState before = state_at(from_ns), after = state_at(to_ns);
  std::map<ObjectId, LoggedEvent> gone;  // the event that says so
  for_each_event([&](const LoggedEvent& logged) {
    const ObjectEvent& event = logged.event;
    if (event.stamp_ns <= from_ns || event.stamp_ns > to_ns) return;
    if (event.absorbed) gone[*event.absorbed] = logged;
    const bool goes = event.kind == EventKind::kRemoved || event.kind == EventKind::kOperator;
    if (goes && event.object != ObjectId::kNone) gone[event.object] = logged;
  });
  std::vector<Difference> list;
  for (const auto& [id, now] : after) {
    const auto then = before.find(id);
    if (then == before.end()) {
      list.push_back({DifferenceKind::kAdded, now, std::nullopt});
      continue;
    }
    const OrientedBox &a = then->second.event.box, &b = now.event.box;
    if (now.event.sequence == then->second.event.sequence) continue;
    const double shift_m = (a.pose.position_W - b.pose.position_W).norm();
    const double growth_m = (a.size_m - b.size_m).cwiseAbs().maxCoeff();
    if (shift_m < least_m && growth_m < least_m) continue;
    const bool moved = now.event.kind == EventKind::kMoved || shift_m > growth_m;
    list.push_back({moved ? DifferenceKind::kMoved : DifferenceKind::kChanged, now, a});
  }
  for (const auto& [id, then] : before) {
    if (after.count(id) > 0) continue;
    const auto why = gone.find(id);
    list.push_back(
        {DifferenceKind::kRemoved, why == gone.end() ? then : why->second, then.event.box});
  }
  return list;
}

std::vector<LoggedEvent> History::life_of(ObjectId id) {
  // An object that was absorbed was told of before: who it is comes later.
  std::set<ObjectId> names{id};
  std::size_t known = 0;
  while (known != names.size()) {
    known = names.size();
    for_each_event([&](const LoggedEvent& logged) {
      if (logged.event.absorbed && names.count(logged.event.object) > 0) {
        names.insert(*logged.event.absorbed);
      }
    });
  }
  std::vector<LoggedEvent> life;
  for_each_event([&](const LoggedEvent& logged) {
    if (names.count(logged.event.object) > 0) life.push_back(logged);
  });
  std::sort(life.begin(), life.end(), [](const LoggedEvent& a, const LoggedEvent& b) {
    return a.event.sequence < b.event.sequence;
  });
  return life;
}

}  // namespace pocd

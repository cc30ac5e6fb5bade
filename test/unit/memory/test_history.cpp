// What the log says about the past: against the events themselves.
#include "memory_run.hpp"
#include "pocd/common/check.hpp"
#include "pocd/memory/history.hpp"

namespace pocd::test {
namespace {

class HistoryOfARun : public ::testing::Test {
 protected:
  void SetUp() override {
    MemoryRunner run(circuit_config(), folder_ / "memory");
    while (run.process(circuit_frames())) {
    }
    events_ = run.events();
    ASSERT_TRUE(run.finish());
    log_.emplace(folder_ / "memory");
    history_.emplace(*log_);
  }
  /// Last event of each object that stands at a time.
  std::map<ObjectId, std::string> expected(StampNs time_ns) const {
    std::map<ObjectId, std::string> state;
    for (const ObjectEvent& e : events_) {
      if (e.stamp_ns > time_ns) continue;
      if (e.absorbed) state.erase(*e.absorbed);
      if (e.kind == EventKind::kRemoved) {
        state.erase(e.object);
      } else {
        state[e.object] = line(e);
      }
    }
    return state;
  }

  const ScratchFolder folder_;
  std::vector<ObjectEvent> events_;
  std::optional<MemoryReader> log_;
  std::optional<History> history_;
};

TEST_F(HistoryOfARun, StateAtEveryEvent) {
  ASSERT_GE(events_.size(), 3u);
  EXPECT_TRUE(history_->state_at(0).empty());
  for (const ObjectEvent& e : events_) {
    for (const StampNs time_ns : {e.stamp_ns - 1, e.stamp_ns}) {
      std::map<ObjectId, std::string> found;
      for (const auto& [id, logged] : history_->state_at(time_ns)) found[id] = line(logged.event);
      EXPECT_EQ(found, expected(time_ns)) << time_ns;
    }
  }
}

TEST_F(HistoryOfARun, DifferencesNameTheirEvidence) {
  const StampNs end_ns = circuit_frames().back().stamp_ns;
  const auto all = history_->between(0, end_ns, 0.0);
  EXPECT_EQ(all.size(), expected(end_ns).size());
  for (const Difference& d : all) {
    EXPECT_EQ(d.kind, DifferenceKind::kAdded);
    EXPECT_FALSE(d.before.has_value());
  }
  EXPECT_TRUE(history_->between(end_ns, end_ns, 0.0).empty());
  const auto removed = std::find_if(events_.begin(), events_.end(), [](const ObjectEvent& e) {
    return e.kind == EventKind::kRemoved;
  });
  ASSERT_NE(removed, events_.end()) << "a box goes";
  const auto gone = history_->between(removed->stamp_ns - 1, removed->stamp_ns, 1e9);
  const auto told = std::find_if(gone.begin(), gone.end(), [&](const Difference& d) {
    return d.kind == DifferenceKind::kRemoved && line(d.evidence.event) == line(*removed);
  });
  ASSERT_NE(told, gone.end());
  EXPECT_TRUE(told->before.has_value());
  for (const Difference& d : gone) EXPECT_EQ(d.evidence.event.stamp_ns, removed->stamp_ns);
  EXPECT_THROW(history_->between(end_ns, 0, 0.0), InputError);
}

TEST_F(HistoryOfARun, LifeOfEachObject) {
  std::set<ObjectId> ids;
  for (const ObjectEvent& e : events_) ids.insert(e.object);
  std::size_t told = 0;
  for (const ObjectId id : ids) {
    const std::vector<LoggedEvent> life = history_->life_of(id);
    std::size_t own = 0;
    for (std::size_t i = 0; i < life.size(); ++i) {
      own += life[i].event.object == id;
      if (i > 0) {
        EXPECT_LT(life[i - 1].event.sequence, life[i].event.sequence);
      }
    }
    EXPECT_EQ(own, static_cast<std::size_t>(
                       std::count_if(events_.begin(), events_.end(),
                                     [&](const ObjectEvent& e) { return e.object == id; })));
    told += own;
  }
  EXPECT_EQ(told, events_.size());
  EXPECT_TRUE(history_->life_of(ObjectId{4'000'000}).empty());
}

}  // namespace
}  // namespace pocd::test

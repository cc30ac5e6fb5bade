#include "pocd/input/problem_counter.hpp"

namespace pocd {

ProblemCounter::Seen& ProblemCounter::entry_of(const std::string& topic,
                                               const std::string& reason) {
  std::pair<std::string, std::string> key{topic, reason};
  if (seen_.size() >= kMostPairs && seen_.count(key) == 0) key = {"other topics", "more_problems"};
  return seen_[key];
}

void ProblemCounter::count(const std::string& topic, const InputProblem& problem,
                           std::uint64_t times) {
  if (!used_anyway(problem)) refused_ += times;
  count(topic, to_string(problem.reason), problem.detail, times);
}

void ProblemCounter::count(const std::string& topic, const std::string& reason,
                           const std::string& detail, std::uint64_t times) {
  if (times == 0) return;
  Seen& seen = entry_of(topic, reason);
  if (seen.count == 0) {
    seen.detail = detail;
    if (tell_) tell_({topic, reason, times, detail});
  }
  seen.count += times;
}

std::vector<ProblemCounter::Entry> ProblemCounter::entries() const {
  std::vector<Entry> entries;
  for (const auto& [key, seen] : seen_) {
    entries.push_back({key.first, key.second, seen.count, seen.detail});
  }
  return entries;
}

std::uint64_t ProblemCounter::total() const {
  std::uint64_t total = 0;
  for (const auto& [key, seen] : seen_) total += seen.count;
  return total;
}

std::string text_of(const ProblemCounter::Entry& entry) {
  return entry.topic + ": " + entry.reason + ": " + entry.detail;
}

}  // namespace pocd

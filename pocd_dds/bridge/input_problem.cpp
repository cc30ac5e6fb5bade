#include "pocd_dds/bridge/input_problem.hpp"

#include "pocd_dds/entities/bus_log.hpp"

namespace pocd::dds {

ProblemCounter::Seen& ProblemCounter::entry_of(const std::string& topic,
                                               const std::string& reason) {
  std::pair<std::string, std::string> key{topic, reason};
  if (seen_.size() >= kMostPairs && seen_.count(key) == 0) key = {"other topics", "more_problems"};
  return seen_[key];
}

void ProblemCounter::count(const std::string& topic, const std::string& reason,
                           const std::string& detail, std::uint64_t times) {
  if (times == 0) return;
  Seen& seen = entry_of(topic, reason);
  if (seen.count == 0) {
    seen.detail = detail;
    log_warning("{}: {}: {} (logged once, counted)", topic, reason, detail);
  }
  seen.count += times;
}

void ProblemCounter::count_incompatible(RawReader& reader) {
  const std::uint64_t times = reader.take_incompatible();
  if (times == 0) return;
  Seen& seen = entry_of(reader.topic(), to_string(InputReason::kIncompatibleQos));
  seen.detail = "a writer does not offer the " + reader.refused_policy() + " that is asked for";
  seen.count += times;
}

void ProblemCounter::count_damaged(RawReader& reader) {
  count(reader.topic(), "damaged", "a message that cannot be read", reader.take_damaged());
  count(reader.topic(), "other_idl", reader.misread_from(), reader.take_misread());
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

}  // namespace pocd::dds

#include "pocd_dds/bridge/input_problem.hpp"

#include "pocd_dds/entities/bus_log.hpp"

namespace pocd::dds {

ProblemCounter::ProblemCounter()
    : pocd::ProblemCounter(
          [](const Entry& entry) { log_warning("{} (logged once, counted)", text_of(entry)); }) {}

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

}  // namespace pocd::dds

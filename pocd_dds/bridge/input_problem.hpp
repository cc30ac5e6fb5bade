// How often messages were wrong, by topic and reason.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pocd/input/input_problem.hpp"
#include "pocd_dds/entities/reader.hpp"

namespace pocd::dds {

/// Counts problems by topic and reason; each pair is logged the first time only. Not thread-safe.
class ProblemCounter {
 public:
  void count(const std::string& topic, const InputProblem& problem, std::uint64_t times = 1);

  /// Writers that the reader cannot hear; it has logged that itself.
  void count_incompatible(RawReader& reader);

  struct Entry {
    std::string topic;
    std::string reason;
    std::uint64_t count;
    std::string detail;  ///< of the first one
  };
  /// By topic, then reason.
  std::vector<Entry> entries() const;
  std::uint64_t total() const;

 private:
  struct Seen {
    std::uint64_t count = 0;
    std::string detail;
  };
  std::map<std::pair<std::string, InputReason>, Seen> seen_;
};

}  // namespace pocd::dds

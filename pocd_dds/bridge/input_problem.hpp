// How often messages were wrong, by topic and reason.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pocd/input/input_problem.hpp"
#include "pocd_dds/entities/reader.hpp"

namespace pocd::dds {

/// Counts problems by topic and reason; each pair is logged the first time only. Topics are named
/// by peers: beyond `kMostPairs` pairs, all further ones are counted as one. Not thread-safe.
class ProblemCounter {
 public:
  static constexpr std::size_t kMostPairs = 200;

  void count(const std::string& topic, const InputProblem& problem, std::uint64_t times = 1) {
    count(topic, to_string(problem.reason), problem.detail, times);
  }
  void count(const std::string& topic, const std::string& reason, const std::string& detail,
             std::uint64_t times);

  /// Writers that the reader cannot hear; it has logged that itself.
  void count_incompatible(RawReader& reader);
  /// Messages that the reader took and could not read, or must not, because their writer has
  /// another version of the type. From the thread that takes.
  void count_damaged(RawReader& reader);

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
  /// The pair's count, or that of all for which there is no room.
  Seen& entry_of(const std::string& topic, const std::string& reason);

  std::map<std::pair<std::string, std::string>, Seen> seen_;
};

}  // namespace pocd::dds

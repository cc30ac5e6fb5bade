// How often messages were wrong, by topic and reason.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pocd/input/input_problem.hpp"

namespace pocd {

/// Counts problems by topic and reason; each pair is told the first time only. Topics are named by
/// peers: beyond `kMostPairs` pairs, all further ones are counted as one. Not thread-safe.
class ProblemCounter {
 public:
  static constexpr std::size_t kMostPairs = 200;

  struct Entry {
    std::string topic;
    std::string reason;
    std::uint64_t count;
    std::string detail;  ///< of the first one
  };
  /// `tell` gets the first of each pair.
  explicit ProblemCounter(std::function<void(const Entry&)> tell) : tell_(std::move(tell)) {}

  void count(const std::string& topic, const InputProblem& problem, std::uint64_t times = 1);
  void count(const std::string& topic, const std::string& reason, const std::string& detail,
             std::uint64_t times);

  /// By topic, then reason.
  std::vector<Entry> entries() const;
  std::uint64_t total() const;
  /// Of those that cost something: messages that were not used.
  std::uint64_t refused() const { return refused_; }

 protected:
  struct Seen {
    std::uint64_t count = 0;
    std::string detail;
  };
  /// The pair's count, or that of all for which there is no room.
  Seen& entry_of(const std::string& topic, const std::string& reason);

 private:
  std::function<void(const Entry&)> tell_;
  std::map<std::pair<std::string, std::string>, Seen> seen_;
  std::uint64_t refused_ = 0;
};

/// "TOPIC: REASON: DETAIL", wherever a problem is told.
std::string text_of(const ProblemCounter::Entry& entry);

}  // namespace pocd

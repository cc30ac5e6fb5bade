// The bus's own problems beside those of messages.
#pragma once

#include "pocd/input/problem_counter.hpp"
#include "pocd_dds/entities/reader.hpp"

namespace pocd::dds {

/// Tells on the log. Not thread-safe.
class ProblemCounter : public pocd::ProblemCounter {
 public:
  ProblemCounter();

  /// Writers that the reader cannot hear; it has logged that itself.
  void count_incompatible(RawReader& reader);
  /// Messages that the reader took and could not read, or must not, because their writer has
  /// another version of the type. From the thread that takes.
  void count_damaged(RawReader& reader);
};

}  // namespace pocd::dds

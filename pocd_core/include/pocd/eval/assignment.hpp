// Optimal one-to-one assignment over gated pairs.
#pragma once

#include <vector>

namespace pocd {

/// A pair that the gates let through. Rows and columns are indices >= 0.
struct AssignmentCandidate {
  int row = 0;
  int column = 0;
  double cost = 0.0;  ///< >= 0; infinite = not allowed
};

struct AssignedPair {
  int row = 0;
  int column = 0;

  bool operator==(const AssignedPair& o) const { return row == o.row && column == o.column; }
};

/// The set of pairs, at most one per row and per column, of least total cost, where leaving a row
/// and a column unpaired costs `cutoff` (> 0) together. In other words it maximises the sum of
/// cutoff - cost over the pairs; so a pair at or above the cutoff is never made. A pair not listed
/// is not allowed.
///
/// Sorted by row. Does not depend on the order of the candidates; of equally good solutions always
/// the same one is returned. Costs are compared with a resolution of cutoff / 2^40. Each connected
/// component of the gate graph is solved by itself, in O(n^3) of its larger side (dlib's Hungarian
/// algorithm). Throws std::logic_error for negative indices or costs, NaN, or a pair listed twice.
std::vector<AssignedPair> assign(std::vector<AssignmentCandidate> candidates, double cutoff);

}  // namespace pocd

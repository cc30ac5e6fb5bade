// Whether E[v] means what it says: of the objects believed in with 0.8, four in five should be
// there.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pocd/common/types.hpp"
#include "pocd/eval/place_match.hpp"

namespace pocd {

/// Reliability of a probability in ten equal bins, the last one closed.
class Calibration {
 public:
  static constexpr int kBins = 10;
  struct Bin {
    std::uint64_t count = 0;
    double sum_predicted = 0.0;
    std::uint64_t true_count = 0;
  };

  void add(double predicted, bool is_true);
  void merge(const Calibration& other);
  const std::array<Bin, kBins>& bins() const { return bins_; }
  std::uint64_t count() const;
  /// Mean over all samples of |share that is true - mean prediction| of their bin (Guo et al., ICML
  /// 2017); NaN without samples.
  double expected_error() const;

 private:
  std::array<Bin, kBins> bins_;
};

/// Whether the place of a library object still holds what was mapped there: of all places at which
/// true things have stood so far, the one that fits its box best (intersection over union) is taken
/// now. The last element of `visits` are the boxes of this visit. False when no box shares half of
/// the smaller volume.
bool place_is_held(const OrientedBox& box, const std::vector<std::vector<OrientedBox>>& visits,
                   double tolerance_m = kPlaceTolerance_m);

}  // namespace pocd

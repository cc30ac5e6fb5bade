#include "pocd/eval/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pocd/eval/place_match.hpp"

namespace pocd {
void Calibration::add(double predicted, bool is_true) {
  const int bin = std::clamp(static_cast<int>(predicted * kBins), 0, kBins - 1);
  Bin& b = bins_[static_cast<std::size_t>(bin)];
  ++b.count;
  b.sum_predicted += predicted;
  b.true_count += is_true;
}

void Calibration::merge(const Calibration& other) {
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    bins_[i].count += other.bins_[i].count;
    bins_[i].sum_predicted += other.bins_[i].sum_predicted;
    bins_[i].true_count += other.bins_[i].true_count;
  }
}

std::uint64_t Calibration::count() const {
  std::uint64_t n = 0;
  for (const Bin& bin : bins_) n += bin.count;
  return n;
}

double Calibration::expected_error() const {
  if (count() == 0) return std::numeric_limits<double>::quiet_NaN();
  double error = 0.0;
  for (const Bin& bin : bins_)
    error += std::abs(static_cast<double>(bin.true_count) - bin.sum_predicted);
  return error / static_cast<double>(count());
}

bool place_is_held(const OrientedBox& box, const std::vector<std::vector<OrientedBox>>& visits,
                   double tolerance_m) {
  double now = 0.0, before = 0.0;
  bool touches = false;
  for (std::size_t v = 0; v < visits.size(); ++v) {
    const bool current = v + 1 == visits.size();
    for (const OrientedBox& place : visits[v]) {
      const double fit = place_fit(box, place, tolerance_m);
      (current ? now : before) = std::max(current ? now : before, fit);
      touches = touches || (current && same_place(box, place, tolerance_m));
    }
  }
  // Things that stayed have the very same box in both visits.
  return touches && now >= before - 1e-9;
}

}  // namespace pocd

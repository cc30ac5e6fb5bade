#include "pocd/eval/assignment.hpp"

#include <dlib/matrix.h>
#include <dlib/optimization/max_cost_assignment.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// Sums of a few thousand scaled gains stay far below 2^63.
constexpr double kResolution = 0x1p40;

using Candidates = std::vector<AssignmentCandidate>;

// Sorted distinct values of a member.
std::vector<int> distinct(const Candidates& candidates, int AssignmentCandidate::*member) {
  std::vector<int> values;
  for (const auto& c : candidates) values.push_back(c.*member);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

int position(const std::vector<int>& sorted, int value) {
  return static_cast<int>(std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin());
}

// Candidates by connected component; components by their smallest row, candidates in order.
std::vector<Candidates> components(const Candidates& candidates) {
  const std::vector<int> rows = distinct(candidates, &AssignmentCandidate::row);
  const std::vector<int> columns = distinct(candidates, &AssignmentCandidate::column);
  std::vector<int> parent(rows.size() + columns.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& c : candidates) {
    const int a = root(position(rows, c.row));
    const int b = root(static_cast<int>(rows.size()) + position(columns, c.column));
    parent[std::max(a, b)] = std::min(a, b);  // so that a root is the smallest row
  }
  std::vector<Candidates> by_root(rows.size());
  for (const auto& c : candidates) by_root[root(position(rows, c.row))].push_back(c);
  by_root.erase(std::remove_if(by_root.begin(), by_root.end(),
                               [](const Candidates& part) { return part.empty(); }),
                by_root.end());
  return by_root;
}

void solve_component(const Candidates& candidates, double cutoff,
                     std::vector<AssignedPair>& pairs) {
  const std::vector<int> rows = distinct(candidates, &AssignmentCandidate::row);
  const std::vector<int> columns = distinct(candidates, &AssignmentCandidate::column);
  const long n = static_cast<long>(std::max(rows.size(), columns.size()));
  // Gains; a zero stands for "not paired", whether padding or not allowed.
  dlib::matrix<std::int64_t> gain = dlib::zeros_matrix<std::int64_t>(n, n);
  for (const auto& c : candidates) {
    gain(position(rows, c.row), position(columns, c.column)) =
        std::llround((cutoff - c.cost) / cutoff * kResolution);
  }
  const std::vector<long> column_of = dlib::max_cost_assignment(gain);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (gain(static_cast<long>(r), column_of[r]) > 0) {
      pairs.push_back({rows[r], columns[static_cast<std::size_t>(column_of[r])]});
    }
  }
}

}  // namespace

std::vector<AssignedPair> assign(std::vector<AssignmentCandidate> candidates, double cutoff) {
  POCD_CHECK(std::isfinite(cutoff) && cutoff > 0.0);
  for (const auto& c : candidates) POCD_CHECK(c.row >= 0 && c.column >= 0 && c.cost >= 0.0);
  candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                  [cutoff](const auto& c) { return c.cost >= cutoff; }),
                   candidates.end());
  std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.row != b.row ? a.row < b.row : a.column < b.column;
  });
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    POCD_CHECK(candidates[i - 1].row != candidates[i].row ||
               candidates[i - 1].column != candidates[i].column);
  }
  std::vector<AssignedPair> pairs;
  for (const auto& part : components(candidates)) solve_component(part, cutoff, pairs);
  std::sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.row < b.row; });
  return pairs;
}

}  // namespace pocd

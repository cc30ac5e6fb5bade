#include "pocd/eval/assignment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>

#include "pocd/common/random.hpp"

namespace pocd {
namespace {

using Candidates = std::vector<AssignmentCandidate>;

// Sum of cutoff - cost; fails for a pair that is not a candidate, or a row or column used twice.
double gain(const std::vector<AssignedPair>& pairs, const Candidates& candidates, double cutoff) {
  std::set<int> rows, columns;
  double sum = 0.0;
  for (const auto& p : pairs) {
    EXPECT_TRUE(rows.insert(p.row).second);
    EXPECT_TRUE(columns.insert(p.column).second);
    const auto c = std::find_if(candidates.begin(), candidates.end(), [&](const auto& x) {
      return x.row == p.row && x.column == p.column;
    });
    EXPECT_NE(c, candidates.end());
    if (c == candidates.end()) return -1.0;
    EXPECT_LT(c->cost, cutoff);
    sum += cutoff - c->cost;
  }
  return sum;
}

// Best gain over all permutations of a square matrix where a missing pair gains nothing.
double best_gain(const Candidates& candidates, int n, double cutoff) {
  std::vector<double> gains(static_cast<std::size_t>(n * n), 0.0);
  for (const auto& c : candidates) gains[c.row * n + c.column] = std::max(0.0, cutoff - c.cost);
  std::vector<int> columns(static_cast<std::size_t>(n));
  std::iota(columns.begin(), columns.end(), 0);
  double best = 0.0;
  do {
    double sum = 0.0;
    for (int r = 0; r < n; ++r) sum += gains[r * n + columns[r]];
    best = std::max(best, sum);
  } while (std::next_permutation(columns.begin(), columns.end()));
  return best;
}

// The tolerance is n times the documented resolution of the costs.
TEST(Assignment, OptimalAgainstAllPermutations) {
  Random random(31);
  const double cutoff = 3.6;
  int pairs_seen = 0;
  for (int round = 0; round < 600; ++round) {
    const int n = 1 + static_cast<int>(random.below(7));
    const double density = random.uniform(0.1, 1.0);
    Candidates candidates;
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c < n; ++c) {
        if (random.uniform() < density) candidates.push_back({r, c, random.uniform(0.0, 5.0)});
      }
    }
    const auto pairs = assign(candidates, cutoff);
    pairs_seen += static_cast<int>(pairs.size());
    EXPECT_NEAR(gain(pairs, candidates, cutoff), best_gain(candidates, n, cutoff),
                n * cutoff * 0x1p-40);
  }
  EXPECT_GT(pairs_seen, 600);
}

TEST(Assignment, PrefersTheBetterTotalToTheBestPair) {
  // Greedy would take (0, 0) and leave row 1 without a partner.
  const auto pairs = assign({{0, 0, 0.1}, {0, 1, 0.2}, {1, 0, 0.3}}, 1.0);
  EXPECT_EQ(pairs, (std::vector<AssignedPair>{{0, 1}, {1, 0}}));
}

TEST(Assignment, CutoffAndInfinityAreNeverPaired) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(assign({}, 3.6).empty());
  EXPECT_TRUE(assign({{0, 0, 3.6}, {0, 1, 1000.0}, {1, 1, infinity}}, 3.6).empty());
  EXPECT_EQ(assign({{7, 4, 3.5}}, 3.6), (std::vector<AssignedPair>{{7, 4}}));
}

TEST(Assignment, DoesNotDependOnTheOrderOfTies) {
  Random random(32);
  for (int round = 0; round < 100; ++round) {
    Candidates candidates;
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 6; ++c) {
        if (random.uniform() < 0.7)
          candidates.push_back({r, c, 0.5 * static_cast<double>(random.below(3))});
      }
    }
    const auto first = assign(candidates, 2.0);
    for (std::size_t i = candidates.size(); i > 1; --i) {
      std::swap(candidates[i - 1], candidates[random.below(i)]);
    }
    EXPECT_EQ(assign(candidates, 2.0), first);
  }
}

TEST(Assignment, RefusesBadInput) {
  EXPECT_THROW(assign({{0, 0, std::nan("")}}, 1.0), std::logic_error);
  EXPECT_THROW(assign({{0, 0, -0.1}}, 1.0), std::logic_error);
  EXPECT_THROW(assign({{-1, 0, 0.1}}, 1.0), std::logic_error);
  EXPECT_THROW(assign({{0, 0, 0.1}, {0, 0, 0.2}}, 1.0), std::logic_error);
  EXPECT_THROW(assign({{0, 0, 0.1}}, 0.0), std::logic_error);
}

}  // namespace
}  // namespace pocd

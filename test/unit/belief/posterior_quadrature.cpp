#include "posterior_quadrature.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pocd::test {
namespace {

const double kPi = std::acos(-1.0);

struct LegendreRule {
  static constexpr int kOrder = 16;
  std::array<double, kOrder> x{}, w{};
  // Newton's method on the three-term recurrence.
  LegendreRule() {
    for (int i = 0; i < kOrder; ++i) {
      double t = std::cos(kPi * (i + 0.75) / (kOrder + 0.5)), derivative = 1.0;
      for (int step = 0; step < 50; ++step) {
        double p0 = 1.0, p1 = t;
        for (int j = 2; j <= kOrder; ++j) {
          const double p2 = ((2 * j - 1) * t * p1 - (j - 1) * p0) / j;
          p0 = p1, p1 = p2;
        }
        derivative = kOrder * (t * p1 - p0) / (t * t - 1.0);
        t -= p1 / derivative;
      }
      x[i] = t;
      w[i] = 2.0 / ((1.0 - t * t) * derivative * derivative);
    }
  }
};

double normal_density(double x, double mean, double sigma) {
  const double r = (x - mean) / sigma;
  return std::exp(-0.5 * r * r) / (sigma * std::sqrt(2.0 * kPi));
}

void normalise(std::vector<double>& weight) {
  // The smallest first, so that the sum keeps its digits.
  std::vector<double> sorted = weight;
  std::sort(sorted.begin(), sorted.end());
  double sum = 0.0;
  for (double w : sorted) sum += w;
  for (double& w : weight) w /= sum;
}

// [v^s (1 - v)^(1 - s)]^k
double semantic_likelihood(double v, double one_minus_v, const Measurement& z) {
  return std::pow(z.stationarity_class == 1 ? v : one_minus_v, z.k);
}

// Weighted sum, mean and central second moment, in two passes.
struct Summary {
  double mass = 0.0, mean = 0.0, variance = 0.0;
};

template <class F>
Summary summarise(const std::vector<double>& x, const F& weight) {
  Summary s;
  for (std::size_t i = 0; i < x.size(); ++i) s.mass += weight(i), s.mean += weight(i) * x[i];
  s.mean /= s.mass;
  for (std::size_t i = 0; i < x.size(); ++i) {
    s.variance += weight(i) * (x[i] - s.mean) * (x[i] - s.mean);
  }
  s.variance /= s.mass;
  return s;
}

Moments finish(const Rule& l, const Rule& v, const std::vector<double>& weight_l,
               const std::vector<double>& weight_v) {
  const auto of_l = [&](std::size_t i) { return weight_l[i]; };
  const auto of_v = [&](std::size_t i) { return weight_v[i]; };
  const Summary sl = summarise(l.x, of_l);
  const Summary sv = summarise(v.x, of_v);
  const Summary sw = summarise(v.one_minus_x, of_v);
  // Near v = 1 the variance is the variance of 1 - v, which has the digits there.
  return {sl.mean, sl.variance, sv.mean, sw.mean, sv.mean < 0.5 ? sv.variance : sw.variance};
}

}  // namespace

Rule beta_rule(double alpha, double beta) {
  // With u = log(v / (1 - v)) the density is proportional to v^alpha (1 - v)^beta on the whole
  // line: no singularities, exponential tails of rates alpha and beta. With u = mode + width
  // sinh(x) the tails end within |x| < limit, and the trapezoid rule converges exponentially.
  const double mode = std::log(alpha / beta);
  const double width = std::min(1.0, 1.0 / std::sqrt(std::min(alpha, beta)));
  const double slowest = std::min({alpha, beta, 1.0});
  const double limit = std::asinh(60.0 / (slowest * width) + 60.0 / width);
  const int n = 6000;
  std::vector<double> log_density(n + 1), u(n + 1);
  Rule rule;
  double largest = -1e300;
  for (int i = 0; i <= n; ++i) {
    const double x = -limit + 2.0 * limit * i / n;
    u[i] = mode + width * std::sinh(x);
    const double log_v =
        u[i] > 0 ? -std::log1p(std::exp(-u[i])) : u[i] - std::log1p(std::exp(u[i]));
    const double log_w =
        u[i] > 0 ? -u[i] - std::log1p(std::exp(-u[i])) : -std::log1p(std::exp(u[i]));
    log_density[i] = alpha * log_v + beta * log_w + std::log(std::cosh(x));
    largest = std::max(largest, log_density[i]);
    rule.x.push_back(std::exp(log_v));
    rule.one_minus_x.push_back(std::exp(log_w));
  }
  for (double log_d : log_density) rule.weight.push_back(std::exp(log_d - largest));
  normalise(rule.weight);
  return rule;
}

Rule normal_rule(const Belief& prior, double delta_m, double tau_m) {
  static const LegendreRule legendre;
  const int reach = 40;  // deviations; the density beyond is below 1e-300
  std::vector<double> knots;
  for (int j = -reach; j <= reach; ++j) {
    knots.push_back(prior.mu + j * prior.sigma);
    const double x = delta_m + j * tau_m;
    if (std::abs(x - prior.mu) < reach * prior.sigma) knots.push_back(x);
  }
  std::sort(knots.begin(), knots.end());
  Rule rule;
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    const double half = 0.5 * (knots[i + 1] - knots[i]), mid = knots[i] + half;
    for (int j = 0; j < LegendreRule::kOrder; ++j) {
      const double l = mid + half * legendre.x[j];
      rule.x.push_back(l);
      rule.weight.push_back(half * legendre.w[j] * normal_density(l, prior.mu, prior.sigma));
    }
  }
  normalise(rule.weight);
  return rule;
}

Moments posterior_moments_2d(const Belief& prior, const Measurement& z, double delta_max_m) {
  const Rule l = normal_rule(prior, z.delta_m, z.sigma_m);
  const Rule v = beta_rule(prior.alpha, prior.beta);
  std::vector<double> inlier(l.x.size()), weight_l(l.x.size(), 0.0), weight_v(v.x.size(), 0.0);
  for (std::size_t i = 0; i < l.x.size(); ++i) {
    inlier[i] = normal_density(z.delta_m, l.x[i], z.sigma_m);
  }
  for (std::size_t j = 0; j < v.x.size(); ++j) {
    const double semantic = semantic_likelihood(v.x[j], v.one_minus_x[j], z);
    for (std::size_t i = 0; i < l.x.size(); ++i) {
      const double likelihood =
          (v.x[j] * inlier[i] + v.one_minus_x[j] / (2.0 * delta_max_m)) * semantic;
      const double w = likelihood * l.weight[i] * v.weight[j];
      weight_l[i] += w;
      weight_v[j] += w;
    }
  }
  return finish(l, v, weight_l, weight_v);
}

Moments posterior_moments(const Belief& prior, const Measurement& z, double delta_max_m) {
  const Rule l = normal_rule(prior, z.delta_m, z.sigma_m);
  const Rule v = beta_rule(prior.alpha, prior.beta);
  std::vector<double> inlier(l.x.size()), semantic(v.x.size());
  double l_inlier = 0.0, v_inlier = 0.0, v_outlier = 0.0;
  for (std::size_t i = 0; i < l.x.size(); ++i) {
    inlier[i] = normal_density(z.delta_m, l.x[i], z.sigma_m);
    l_inlier += inlier[i] * l.weight[i];
  }
  for (std::size_t j = 0; j < v.x.size(); ++j) {
    semantic[j] = semantic_likelihood(v.x[j], v.one_minus_x[j], z) * v.weight[j];
    v_inlier += v.x[j] * semantic[j];
    v_outlier += v.one_minus_x[j] * semantic[j] / (2.0 * delta_max_m);
  }
  std::vector<double> weight_l(l.x.size()), weight_v(v.x.size());
  for (std::size_t i = 0; i < l.x.size(); ++i) {
    weight_l[i] = (inlier[i] * v_inlier + v_outlier) * l.weight[i];
  }
  for (std::size_t j = 0; j < v.x.size(); ++j) {
    weight_v[j] = (v.x[j] * l_inlier + v.one_minus_x[j] / (2.0 * delta_max_m)) * semantic[j];
  }
  return finish(l, v, weight_l, weight_v);
}

}  // namespace pocd::test

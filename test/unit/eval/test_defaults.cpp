// What is a default in two places is one value.
#include <gtest/gtest.h>

#include "pocd/belief/belief.hpp"
#include "pocd/belief/state_config.hpp"
#include "pocd/eval/published_config.hpp"
#include "pocd/eval/ray_traced_change.hpp"
#include "pocd/observe/association_config.hpp"
#include "pocd/registration/point_to_plane_icp.hpp"

namespace pocd {
namespace {

TEST(Defaults, ANewBeliefIsThatOfTheConfiguration) {
  const Belief belief;
  const StateConfig state;
  EXPECT_NEAR(belief.alpha, state.initial_stationarity * state.initial_count, 1e-12);
  EXPECT_NEAR(belief.alpha + belief.beta, state.initial_count, 1e-12);
  EXPECT_EQ(belief.sigma, state.initial_sigma_m);
  const PublishedConfig published;
  EXPECT_EQ(published.initial_stationarity, state.initial_stationarity);
  EXPECT_EQ(published.initial_count, state.initial_count);
  EXPECT_EQ(published.max_count, state.max_count);
  EXPECT_EQ(published.initial_sigma_m, state.initial_sigma_m);
}

TEST(Defaults, AlignmentAndChangeAreThoseOfTheConfiguration) {
  const AssociationConfig association;
  const PublishedConfig published;
  EXPECT_EQ(IcpOptions().max_iterations, association.icp_iterations);
  EXPECT_EQ(IcpOptions().max_iterations, published.icp_iterations);
  EXPECT_EQ(association.icp_points, published.icp_points);
  EXPECT_EQ(association.icp_max_distance_m, published.icp_max_distance_m);
  EXPECT_EQ(RayTracedChangeOptions().truncation_m, published.tsdf_truncation_m);
  EXPECT_EQ(RayTracedChangeOptions().lambda_diff, published.lambda_diff);
}

}  // namespace
}  // namespace pocd

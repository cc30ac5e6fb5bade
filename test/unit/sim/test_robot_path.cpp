#include "pocd/sim/robot_path.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

PathSpec square(double corner_radius_m, double start_m) {
  PathSpec spec;
  spec.waypoints_m = {{-2.5, -2.5}, {2.5, -2.5}, {2.5, 2.5}, {-2.5, 2.5}};
  spec.corner_radius_m = corner_radius_m;
  spec.start_m = start_m;
  spec.speed_m_s = 0.8;
  spec.turn_rate_rad_s = 1.0;
  return spec;
}

TEST(RobotPath, LapEndsWhereItBeganAndNeverJumps) {
  for (const double radius : {0.0, 0.4}) {
    for (const double start_m : {0.0, 2.5, 11.0}) {
      const RobotPath path(square(radius, start_m), "test");
      EXPECT_TRUE(path.base_at(0.0).isApprox(path.base_at(path.duration_s()), 1e-9));
      Pose last = path.base_at(0.0);
      for (double t = 0.01; t <= path.duration_s(); t += 0.01) {
        const Pose now = path.base_at(t);
        // 0.8 m/s and 1 rad/s over 10 ms; the slack is rounding.
        ASSERT_LE((now.translation() - last.translation()).norm(), 0.008 + 1e-9) << t;
        ASSERT_LE(Eigen::AngleAxisd(now.linear().transpose() * last.linear()).angle(), 0.01 + 1e-7);
        last = now;
      }
    }
  }
}

TEST(RobotPath, DurationIsLinesPlusTurns) {
  // On the spot: 20 m at 0.8 m/s and 2 pi at 1 rad/s.
  EXPECT_NEAR(RobotPath(square(0, 0), "test").duration_s(), 25.0 + 2 * M_PI, 1e-9);
  // Radius 0.4: 4 lines of 4.2 m, arcs limited by the turn rate (0.4 m/s < 0.8 m/s).
  EXPECT_NEAR(RobotPath(square(0.4, 0), "test").duration_s(), 4 * 4.2 / 0.8 + 2 * M_PI, 1e-9);
  PathSpec twice = square(0.4, 0);
  twice.laps = 2;
  EXPECT_NEAR(RobotPath(twice, "test").duration_s(), 2 * (4 * 4.2 / 0.8 + 2 * M_PI), 1e-9);
}

TEST(RobotPath, HeadsAlongTheLine) {
  const RobotPath path(square(0.4, 2.5), "test");
  const Pose start = path.base_at(0.0);
  EXPECT_NEAR((start.translation() - Eigen::Vector3d(0, -2.5, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((start.linear().col(0) - Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-9);
  PathSpec open = square(0, 0);
  open.closed = false;
  const RobotPath half(open, "test");
  const Pose end = half.base_at(half.duration_s());
  EXPECT_NEAR((end.translation() - Eigen::Vector3d(-2.5, 2.5, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((end.linear().col(0) + Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-9);
}

TEST(RobotPath, RefusesImpossiblePaths) {
  const auto refused = [](const PathSpec& spec) { EXPECT_THROW(RobotPath(spec, "x"), InputError); };
  PathSpec spec = square(0, 0);
  spec.waypoints_m.resize(1);
  refused(spec);
  spec = square(0, 0);
  spec.waypoints_m[1] = spec.waypoints_m[0];
  refused(spec);
  spec = square(2.6, 0);  // two arcs of 2.6 m do not fit on 5 m
  refused(spec);
  spec = square(0, 0);
  spec.speed_m_s = 0.0;
  refused(spec);
  spec = square(0, 21.0);
  refused(spec);
}

}  // namespace
}  // namespace pocd

#include "pocd/objects/object_model.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "pocd/common/random.hpp"

namespace pocd {
namespace {

constexpr double kSpacing_m = 0.05;

SurfacePoint point(float x, float y, float z, const Eigen::Vector3f& normal_W = {0, 0, 1},
                   float sigma_m = 0.01f) {
  return {{x, y, z}, normal_W, sigma_m};
}

/// Fuses one frame more.
int fuse(ObjectModel& model, const std::vector<SurfacePoint>& points) {
  static StampNs stamp_ns = 0;
  return model.fuse(points, ++stamp_ns);
}

/// Grid of points on z = 0, one per cell of the model.
std::vector<SurfacePoint> sheet(int side, float z = 0.001f) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < side * side; ++i) {
    const auto cell = [](int k) {
      return (static_cast<float>(k) + 0.5f) * static_cast<float>(kSpacing_m);
    };
    points.push_back(point(cell(i % side), cell(i / side), z));
  }
  return points;
}

TEST(ObjectModel, NewPointsBecomeSurfelsInTheirOrder) {
  ObjectModel model(kSpacing_m);
  const auto points = sheet(4);
  EXPECT_EQ(fuse(model, points), 16);
  ASSERT_EQ(model.surfels().size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(model.surfels()[i].point_W, points[i].point_W);
    EXPECT_EQ(model.surfels()[i].normal_W, points[i].normal_W);
    EXPECT_EQ(model.surfels()[i].hits, 1);
    EXPECT_FLOAT_EQ(model.surfels()[i].weight, 1.0f / (0.01f * 0.01f));
  }
  EXPECT_EQ(fuse(model, points), 0) << "the same points again are no new ones";
  for (const Surfel& s : model.surfels()) EXPECT_EQ(s.hits, 2);
}

TEST(ObjectModel, FuseMovesAlongTheNormalByInverseVariance) {
  ObjectModel model(kSpacing_m);
  fuse(model, {point(0.02f, 0.02f, 0.02f, {0, 0, 1}, 0.01f)});
  // Twice the sigma: a quarter of the weight, a fifth of the step. The step sideways is not taken.
  fuse(model, {point(0.03f, 0.01f, 0.03f, {0, 0, 1}, 0.02f)});
  ASSERT_EQ(model.surfels().size(), 1u);
  const Surfel& s = model.surfels()[0];
  EXPECT_FLOAT_EQ(s.point_W.x(), 0.02f);
  EXPECT_FLOAT_EQ(s.point_W.y(), 0.02f);
  EXPECT_NEAR(s.point_W.z(), 0.022f, 1e-6f);
  EXPECT_NEAR(s.weight, 12500.0f, 1.0f);
}

TEST(ObjectModel, FuseWithoutANormalMovesFreely) {
  ObjectModel model(kSpacing_m);
  fuse(model, {point(0.02f, 0.02f, 0.02f, {0, 0, 0})});
  fuse(model, {point(0.03f, 0.01f, 0.02f, {0, 0, 0})});
  EXPECT_LT((model.surfels()[0].point_W - Eigen::Vector3f(0.025f, 0.015f, 0.02f)).norm(), 1e-6f);
}

TEST(ObjectModel, NormalIsAveragedAndTakenOverWhereUnknown) {
  ObjectModel model(kSpacing_m);
  fuse(model, {point(0.02f, 0.02f, 0.02f, {0, 0, 0})});
  fuse(model, {point(0.02f, 0.02f, 0.02f, {1, 0, 0})});
  EXPECT_LT((model.surfels()[0].normal_W - Eigen::Vector3f::UnitX()).norm(), 1e-6f);
  for (int i = 0; i < 200; ++i) fuse(model, {point(0.02f, 0.02f, 0.02f, {0, 1, 0})});
  EXPECT_NEAR(model.surfels()[0].normal_W.norm(), 1.0f, 1e-5f);
  EXPECT_GT(model.surfels()[0].normal_W.y(), 0.99f) << "evidence turns it";
}

TEST(ObjectModel, OldSurfelStillFollowsItsSurface) {
  ObjectModel model(kSpacing_m);
  for (int i = 0; i < 5000; ++i) fuse(model, {point(0.02f, 0.02f, 0.01f)});
  for (int i = 0; i < 200; ++i) fuse(model, {point(0.02f, 0.02f, 0.03f)});
  EXPECT_NEAR(model.surfels()[0].point_W.z(), 0.03f, 0.001f);
}

TEST(ObjectModel, AveragingBeatsTheNoise) {
  Random random(31);
  ObjectModel model(kSpacing_m);
  constexpr float kSigma = 0.008f;  // points stay within reach of their surfel
  for (int frame = 0; frame < 100; ++frame) {
    auto points = sheet(10);
    for (auto& p : points) {
      p.sigma_m = kSigma;
      p.point_W.z() = kSigma * static_cast<float>(random.normal());
    }
    fuse(model, points);
  }
  ASSERT_EQ(model.surfels().size(), 100u);
  double squares = 0.0;
  for (const Surfel& s : model.surfels()) squares += s.point_W.z() * s.point_W.z();
  // A cap of 30 frames leaves sigma / sqrt(2 * 30) in the long run; twice that.
  EXPECT_LT(std::sqrt(squares / 100.0), 2.0 * kSigma / std::sqrt(60.0));
}

TEST(ObjectModel, NearestAgainstBruteForce) {
  Random random(32);
  ObjectModel model(kSpacing_m);
  std::vector<SurfacePoint> points;
  for (int i = 0; i < 800; ++i) {
    const auto at = [&] { return static_cast<float>(random.uniform(-0.5, 0.5)); };
    points.push_back(point(at(), at(), at(), {0, 0, 0}));
  }
  fuse(model, points);
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3f query(static_cast<float>(random.uniform(-0.6, 0.6)),
                                static_cast<float>(random.uniform(-0.6, 0.6)),
                                static_cast<float>(random.uniform(-0.6, 0.6)));
    const float radius = static_cast<float>(random.uniform(0.005, kSpacing_m));
    float least = std::numeric_limits<float>::infinity();
    for (const Surfel& s : model.surfels()) least = std::min(least, (s.point_W - query).norm());
    const int index = model.nearest(query, radius);
    ASSERT_EQ(index != ObjectModel::kNone, least <= radius);
    if (index == ObjectModel::kNone) continue;
    ++found;
    ASSERT_FLOAT_EQ((model.surfels()[index].point_W - query).norm(), least);
  }
  EXPECT_GT(found, 50);
}

TEST(ObjectModel, ExplainedShareIsThatOfPointsWithASurfelNear) {
  ObjectModel model(kSpacing_m);
  EXPECT_EQ(model.explained_share(sheet(10), 0.05f, 1000), 0.0)
      << "an empty model explains nothing";
  fuse(model, sheet(10));
  EXPECT_EQ(model.explained_share({}, 0.05f, 1000), 0.0);
  EXPECT_EQ(model.explained_share(sheet(10), 0.03f, 1000), 1.0);
  EXPECT_EQ(model.explained_share(sheet(10, 0.5f), 0.03f, 1000), 0.0);
  // A sheet twice as long in each direction: a quarter of it lies on the model, and up to one row
  // more within the radius.
  EXPECT_NEAR(model.explained_share(sheet(20), 0.03f, 1000), 0.25, 1e-9);
  // With a budget it looks at every fourth point: the share of these.
  EXPECT_NEAR(model.explained_share(sheet(20), 0.03f, 100), 0.25, 0.06);
}

TEST(ObjectModel, ExtractTakesOutWhatIsMarked) {
  ObjectModel model(kSpacing_m);
  fuse(model, sheet(4));
  const std::vector<Surfel> all = model.surfels();
  std::vector<std::uint8_t> marked(16, 0);
  EXPECT_TRUE(model.extract(marked).empty());
  EXPECT_EQ(model.surfels().size(), 16u);
  for (const std::size_t i : {0u, 3u, 4u, 9u, 15u}) marked[i] = 1;
  const std::vector<Surfel> out = model.extract(marked);
  ASSERT_EQ(out.size(), 5u);
  EXPECT_EQ(out[1].point_W, all[3].point_W) << "in their order";
  ASSERT_EQ(model.surfels().size(), 11u);
  // The look-up knows: what was taken out is not found, what stayed is.
  for (std::size_t i = 0; i < 16; ++i) {
    const int index = model.nearest(all[i].point_W, 0.02f);
    ASSERT_EQ(index == ObjectModel::kNone, marked[i] != 0) << i;
    if (marked[i]) continue;
    ASSERT_LT(static_cast<std::size_t>(index), model.surfels().size());
    EXPECT_EQ(model.surfels()[index].point_W, all[i].point_W);
  }
  EXPECT_THROW(model.extract(marked), std::logic_error) << "one mark per surfel";
}

TEST(ObjectModel, AddGivesBackWhatExtractTook) {
  Random random(33);
  for (int round = 0; round < 20; ++round) {
    ObjectModel model(kSpacing_m);
    fuse(model, sheet(8));
    for (Surfel& s : model.surfels()) s.hits = static_cast<std::uint16_t>(2 + random.below(50));
    std::map<std::pair<float, float>, int> hits;
    for (const Surfel& s : model.surfels()) hits[{s.point_W.x(), s.point_W.y()}] = s.hits;
    std::vector<std::uint8_t> marked;
    for (std::size_t i = 0; i < 64; ++i) marked.push_back(random.below(3) == 0);
    const std::vector<Surfel> out = model.extract(marked);
    model.add(out);
    ASSERT_EQ(model.surfels().size(), 64u);
    for (const Surfel& s : model.surfels()) {
      EXPECT_EQ(s.hits, (hits[{s.point_W.x(), s.point_W.y()}])) << "as it was";
      EXPECT_NE(model.nearest(s.point_W, 0.01f), ObjectModel::kNone);
    }
    model.add(out);
    EXPECT_EQ(model.surfels().size(), 64u) << "where surface is none is added";
  }
}

// A dense image gives a surfel many points; they are one look all the same.
TEST(ObjectModel, HitsCountFramesNotPoints) {
  ObjectModel model(kSpacing_m);
  std::vector<SurfacePoint> dense;
  for (int i = 0; i < 50; ++i)
    dense.push_back(point(0.02f + 0.0002f * static_cast<float>(i), 0.02f, 0.02f));
  model.fuse(dense, 100);
  ASSERT_EQ(model.surfels().size(), 1u);
  EXPECT_EQ(model.surfels()[0].hits, 1);
  EXPECT_EQ(model.surfels()[0].last_hit_ns, 100);
  model.fuse(dense, 200);
  EXPECT_EQ(model.surfels()[0].hits, 2);
  EXPECT_EQ(model.surfels()[0].last_hit_ns, 200);
  // Two pieces of one observation are fused one after the other.
  model.fuse(dense, 200);
  EXPECT_EQ(model.surfels()[0].hits, 2);
}

TEST(ObjectModel, ArrivedIsWhatTheFirstPointWas) {
  ObjectModel model(kSpacing_m);
  SurfacePoint p = point(0.02f, 0.02f, 0.02f), q = point(0.22f, 0.02f, 0.02f);
  p.arrived = true;
  fuse(model, {p, q});
  EXPECT_TRUE(model.surfels()[0].arrived);
  EXPECT_FALSE(model.surfels()[1].arrived);
  p.arrived = false;
  q.arrived = true;
  fuse(model, {p, q});
  EXPECT_TRUE(model.surfels()[0].arrived);
  EXPECT_FALSE(model.surfels()[1].arrived) << "its place was not seen empty before it";
}

TEST(ObjectModel, MeasuringAgainRestartsTheCount) {
  ObjectModel model(kSpacing_m);
  fuse(model, sheet(2));
  for (Surfel& s : model.surfels()) s.seen_through = 4;
  fuse(model, sheet(2));
  for (const Surfel& s : model.surfels()) EXPECT_EQ(s.seen_through, 0);
}

TEST(ObjectModel, AbsorbAddsOnlyWhereNothingIs) {
  ObjectModel model(kSpacing_m), other(kSpacing_m);
  fuse(model, sheet(10));
  fuse(other, sheet(20));
  const std::size_t own = model.surfels().size();
  model.absorb(other);
  EXPECT_EQ(model.surfels().size(), 400u);
  for (std::size_t i = 0; i < own; ++i) EXPECT_EQ(model.surfels()[i].hits, 1);
  EXPECT_EQ(model.explained_share(sheet(20), 0.01f, 1000), 1.0);
  model.absorb(other);
  EXPECT_EQ(model.surfels().size(), 400u);
}

TEST(ObjectModel, TransformMovesPointsAndNormalsAndTheLookUp) {
  ObjectModel model(kSpacing_m);
  fuse(model, sheet(6));
  const auto before = model.surfels();
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  T.translation() = Eigen::Vector3d(1.0, 2.0, 3.0);
  model.transform(T);
  // Two surfels may fall into one cell of the turned grid, where one of them stays.
  ASSERT_GE(model.surfels().size(), 0.8 * static_cast<double>(before.size()));
  for (const Surfel& s : model.surfels()) {
    const Eigen::Vector3f back = (T.inverse() * s.point_W.cast<double>()).cast<float>();
    EXPECT_NEAR(back.z(), 0.001f, 1e-5f);
    EXPECT_LT((s.normal_W + Eigen::Vector3f::UnitY()).norm(), 1e-5f);
    const int index = model.nearest(s.point_W, 0.01f);
    ASSERT_NE(index, ObjectModel::kNone);
    EXPECT_EQ(model.surfels()[index].point_W, s.point_W);
  }
  EXPECT_EQ(model.nearest(before[7].point_W, 0.05f), ObjectModel::kNone);
}

TEST(ObjectModel, WorksFarFromTheOriginAndBelowIt) {
  for (const float offset : {-4000.0f, 4000.0f}) {
    ObjectModel model(kSpacing_m);
    auto points = sheet(4);
    for (auto& p : points) p.point_W += Eigen::Vector3f(offset, -offset, -20.0f);
    fuse(model, points);
    EXPECT_EQ(model.surfels().size(), 16u);
    EXPECT_EQ(model.explained_share(points, 0.01f, 100), 1.0);
  }
}

TEST(ObjectModel, ANoisyLookTakesNoWeightAway) {
  ObjectModel model(kSpacing_m);
  for (int k = 0; k < 40; ++k) fuse(model, {point(0.02f, 0.02f, 0.02f, {0, 0, 1}, 0.007f)});
  const float before = model.surfels()[0].weight;
  fuse(model, {point(0.02f, 0.02f, 0.02f, {0, 0, 1}, 0.031f)});
  EXPECT_GE(model.surfels()[0].weight, before);
}

TEST(ObjectModel, ASurfelThatCreepsIsFoundWhereItIs) {
  ObjectModel model(kSpacing_m);
  float z = 0.025f;
  fuse(model, {point(0.02f, 0.02f, z)});
  // A centimetre a time, two cells and more in all.
  for (; z < 0.15f; z += 0.01f) {
    for (int k = 0; k < 30; ++k) fuse(model, {point(0.02f, 0.02f, z)});
  }
  ASSERT_EQ(model.surfels().size(), 1u) << "a second layer";
  EXPECT_NEAR(model.surfels()[0].point_W.z(), z, 0.02f);
  EXPECT_EQ(model.nearest({0.02f, 0.02f, z}, 0.03f), 0);
}

}  // namespace
}  // namespace pocd

#include "pocd/observe/parts.hpp"

#include <gtest/gtest.h>

#include <set>

#include "pocd/common/random.hpp"
#include "test_room.hpp"

namespace pocd {
namespace {

using test::kBoxClass;
using test::kCageClass;

constexpr float kSpacing = 0.05f;

/// Points of a face at this y that looks towards -y, one per cell of the spacing.
std::vector<SurfacePoint> face(float x0, float x1, float z0, float z1, float y = 2.025f) {
  std::vector<SurfacePoint> points;
  for (float x = x0 + 0.5f * kSpacing; x < x1; x += kSpacing) {
    for (float z = z0 + 0.5f * kSpacing; z < z1; z += kSpacing)
      points.push_back({{x, y, z}, {0, -1, 0}, 0.01f});
  }
  return points;
}

std::vector<SurfacePoint> operator+(std::vector<SurfacePoint> a,
                                    const std::vector<SurfacePoint>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

OrientedBox box_of(const std::vector<SurfacePoint>& points) {
  Points at, normals;
  for (const SurfacePoint& p : points) at.push_back(p.point_W), normals.push_back(p.normal_W);
  return fit_box(at, normals, 0.005);
}

const SeenEmpty kEmptyBefore = [](const Eigen::Vector3f&) { return true; };
const SeenEmpty kUnknownBefore = [](const Eigen::Vector3f&) { return false; };

/// Some known objects, looked at, and some observations to divide among them.
class Divide : public ::testing::Test {
 protected:
  Look& know(const std::vector<SurfacePoint>& points, Arrival arrival = Arrival::kFound,
             ClassId class_id = kBoxClass) {
    LibraryObject& object = library_.create(kSpacing);
    object.class_id = class_id;
    object.arrival = arrival;
    object.confirmed = true;
    object.model.fuse(points, 1);
    object.model.fuse(points, 2);
    library_.place(object, box_of(points));
    looks_[count_].object = &object;
    looks_[count_].verdict = Verdict::kInPlace;
    return looks_[count_++];
  }

  void see(const std::vector<SurfacePoint>& points, std::uint16_t instance = 0,
           ClassId class_id = kBoxClass) {
    Observation o;
    o.class_id = class_id;
    o.instance = instance;
    o.points = points;
    o.box = box_of(points);
    observations_.list.push_back(o);
  }

  std::vector<Part> divided(const SeenEmpty& seen_empty) {
    return divide(observations_, looks_.data(), count_, seen_empty, {});
  }
  ObjectLibrary library_;
  std::array<Look, 4> looks_;
  std::size_t count_ = 0;
  Observations observations_;
};

TEST_F(Divide, WhatLiesOnTheSurfaceIsExplained) {
  Look& known = know(face(0, 1, 0, 1));
  see(face(0, 1, 0, 1));
  for (const bool empty : {false, true}) {
    const auto parts = divided(empty ? kEmptyBefore : kUnknownBefore);
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].look, &known);
    EXPECT_TRUE(parts[0].explained);
    EXPECT_EQ(parts[0].points.size(), 400u);
    EXPECT_EQ(parts[0].indices.size(), 400u);
  }
}

TEST_F(Divide, FoundBesideKnownIsItsSurface) {
  Look& known = know(face(0, 1, 0, 1));
  see(face(0, 1.5f, 0, 1));
  const auto parts = divided(kUnknownBefore);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_TRUE(parts[0].explained);
  EXPECT_FALSE(parts[1].explained);
  EXPECT_EQ(parts[1].look, &known) << "it goes on";
  EXPECT_GT(parts[1].points.size(), 150u);
}

TEST_F(Divide, ArrivedBesideKnownIsSomethingNew) {
  know(face(0, 1, 0, 1));
  see(face(0, 1.5f, 0, 1));
  const auto parts = divided(kEmptyBefore);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[1].look, nullptr);
  for (const SurfacePoint& p : parts[1].points) EXPECT_TRUE(p.arrived);
}

TEST_F(Divide, ArrivedBesideOneThatArrivedIsItsOtherSide) {
  Look& known = know(face(0, 1, 0, 1), Arrival::kArrived);
  see(face(0, 1.5f, 0, 1));
  const auto parts = divided(kEmptyBefore);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[1].look, &known);
}

TEST_F(Divide, APieceArrivedWhenAGoodPartOfItLiesInFreeSpace) {
  // Near the ground, and where a thing stood before, a free place is not known as one.
  know(face(0, 1, 0, 1));
  see(face(0, 1.5f, 0, 1));
  const auto share = [](float z) { return [z](const Eigen::Vector3f& p) { return p.z() > z; }; };
  EXPECT_EQ(divided(share(0.55f))[1].look, nullptr) << "45 of 100";
  EXPECT_NE(divided(share(0.85f))[1].look, nullptr) << "15 of 100";
}

TEST_F(Divide, NothingGrowsOnAContestedSurface) {
  Look& known = know(face(0, 1, 0, 1));
  known.contested = true;
  see(face(0, 1.5f, 0, 1));
  auto parts = divided(kUnknownBefore);
  ASSERT_EQ(parts.size(), 1u) << "whose the rest is, is open";
  EXPECT_TRUE(parts[0].explained);
  parts = divided(kEmptyBefore);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[1].look, nullptr);
}

TEST_F(Divide, DisplacedThingsAndThoseThatDoNotFitExplainNothing) {
  Look& known = know(face(0, 1, 0, 1));
  see(face(0, 1, 0, 1));
  known.verdict = Verdict::kDisplaced;
  auto parts = divided(kUnknownBefore);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].look, nullptr);
  known.verdict = Verdict::kUnobserved;
  known.fits = false;
  parts = divided(kUnknownBefore);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].look, nullptr);
  known.fits = true;  // what stands of it is its surface
  EXPECT_EQ(divided(kUnknownBefore)[0].look, &known);
}

TEST_F(Divide, FarFromAllThatIsKnownIsNew) {
  know(face(0, 1, 0, 1));
  see(face(0, 1, 0, 1) + face(1.4f, 1.9f, 0, 1));
  const auto parts = divided(kUnknownBefore);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[1].look, nullptr);
  EXPECT_EQ(parts[1].points.size(), 200u);
}

TEST_F(Divide, AnotherClassIsAnotherThing) {
  know(face(0, 1, 0, 1), Arrival::kFound, kCageClass);
  see(face(0, 1.5f, 0, 1));
  const auto parts = divided(kUnknownBefore);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].look, nullptr);
  for (const SurfacePoint& p : parts[0].points)
    EXPECT_GT(p.point_W.x(), 0.95f) << "what lies on the cage is a mask that errs";
}

TEST_F(Divide, PiecesApartAreTwoThings) {
  see(face(0, 0.5f, 0, 1) + face(0.8f, 1.3f, 0, 1));
  EXPECT_EQ(divided(kEmptyBefore).size(), 2u);
}

TEST_F(Divide, OneInstanceStaysTogether) {
  see(face(0, 0.5f, 0, 1) + face(0.8f, 1.3f, 0, 1), 5);
  const auto parts = divided(kEmptyBefore);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].points.size(), 400u);
}

TEST_F(Divide, NoObjectIsInTwoInstances) {
  Look& left = know(face(0, 0.5f, 0, 1));
  see(face(0, 0.5f, 0, 1), 5);
  see(face(0.5f, 1, 0, 1), 6);
  left.observation = 0;
  const auto parts = divided(kUnknownBefore);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].look, &left);
  EXPECT_EQ(parts[1].look, nullptr) << "though it touches";
  EXPECT_EQ(parts[1].observation, 1);
}

TEST_F(Divide, PiecesInOnePlaceAreOne) {
  // An open container: front and sides, and its bottom seen over the front.
  auto walls = face(0, 1, 0, 0.3f);
  std::vector<SurfacePoint> bottom;
  for (float y = 2.025f; y < 2.6f; y += kSpacing) {
    for (float z = 0.025f; z < 0.3f; z += kSpacing) {
      walls.push_back({{0.025f, y, z}, {1, 0, 0}, 0.01f});
      walls.push_back({{0.975f, y, z}, {-1, 0, 0}, 0.01f});
    }
    if (y < 2.2f || y > 2.5f) continue;
    for (float x = 0.275f; x < 0.75f; x += kSpacing)
      bottom.push_back({{x, y, 0.1f}, {0, 0, 1}, 0.01f});
  }
  see(walls + bottom);
  EXPECT_EQ(divided(kEmptyBefore).size(), 1u);
  // The same bottom beside the walls is another thing.
  for (SurfacePoint& p : bottom) p.point_W.x() += 1.5f;
  observations_ = {};
  see(walls + bottom);
  EXPECT_EQ(divided(kEmptyBefore).size(), 2u);
}

TEST_F(Divide, SmallPiecesAreNoise) {
  see(face(0, 0.5f, 0, 1) + face(0.8f, 0.95f, 0, 0.15f));  // 9 points
  EXPECT_EQ(divided(kEmptyBefore).size(), 1u);
}

// Whatever is seen, each point has one owner at most, and parts hold what their indices say.
TEST_F(Divide, NoPointHasTwoOwners) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Random random(seed);
    library_ = {};
    observations_ = {};
    count_ = 0;
    const auto any_face = [&] {
      const auto x = static_cast<float>(random.uniform(-1, 1)),
                 z = static_cast<float>(random.uniform(0, 0.5));
      return face(x, x + static_cast<float>(random.uniform(0.2, 1)), z,
                  z + static_cast<float>(random.uniform(0.2, 0.8)),
                  2.0f + 0.1f * static_cast<float>(random.below(3)));
    };
    for (int k = 0; k < 3; ++k) {
      Look& look = know(any_face(), random.below(2) ? Arrival::kFound : Arrival::kArrived,
                        random.below(4) ? kBoxClass : kCageClass);
      look.contested = random.below(4) == 0;
      look.fits = random.below(3) > 0;
      look.verdict = random.below(4) ? Verdict::kInPlace : Verdict::kUnobserved;
    }
    for (int k = 0; k < 2; ++k) {
      see(any_face() + any_face(), static_cast<std::uint16_t>(random.below(2) * (5 + k)));
    }
    std::set<std::pair<std::int32_t, std::int32_t>> owned;
    for (const Part& part :
         divided([](const Eigen::Vector3f& p) { return std::fmod(p.x() + 10.0f, 0.7f) < 0.35f; })) {
      const Observation& o = observations_.list.at(part.observation);
      ASSERT_EQ(part.points.size(), part.indices.size());
      ASSERT_FALSE(part.points.empty());
      ASSERT_TRUE(part.look || !part.explained);
      if (part.look) {
        ASSERT_EQ(part.look->object->class_id, o.class_id);
      }
      for (std::size_t i = 0; i < part.indices.size(); ++i) {
        ASSERT_EQ(part.points[i].point_W, o.points.at(part.indices[i]).point_W);
        ASSERT_TRUE(owned.insert({part.observation, part.indices[i]}).second) << "seed " << seed;
        if (!part.look || !part.explained) continue;
        ASSERT_NE(part.look->object->model.nearest(part.points[i].point_W, 1.5f * kSpacing),
                  ObjectModel::kNone);
      }
    }
  }
}

}  // namespace
}  // namespace pocd

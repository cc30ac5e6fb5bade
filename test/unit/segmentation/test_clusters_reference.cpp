// The clusters beside a slow and obvious way to find them: a flood fill from pixel to pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "pocd/common/cell_index.hpp"
#include "pocd/common/random.hpp"
#include "pocd/common/rounding.hpp"
#include "test_room.hpp"

namespace pocd {
namespace {

/// Whether pixel b belongs with pixel a before it, as the interface says.
bool belong_together(const OrganizedCloud& cloud, const SegmentationConfig& config,
                     const DepthNoise& noise, std::size_t a, std::size_t b) {
  if (cloud.kind[a] != PixelKind::kObject || cloud.kind[b] != PixelKind::kObject) return false;
  if (cloud.label[a] != cloud.label[b] || cloud.instance[a] != cloud.instance[b]) return false;
  const float z = cloud.depth_m[a];
  const float limit = static_cast<float>(config.cluster_tolerance_m) +
                      2.0f * static_cast<float>(1.0 / cloud.camera.fx) * z +
                      2.0f * static_cast<float>(noise.sigma(z));
  const float dx = cloud.x_W[a] - cloud.x_W[b], dy = cloud.y_W[a] - cloud.y_W[b],
              dz = cloud.z_W[a] - cloud.z_W[b];
  return dx * dx + dy * dy + dz * dz < limit * limit;
}

/// Component of every object pixel, -1 elsewhere.
std::vector<int> flood_fill(const OrganizedCloud& cloud, const SegmentationConfig& config,
                            const DepthNoise& noise) {
  std::vector<std::vector<std::size_t>> neighbours(cloud.size());
  const auto try_join = [&](std::size_t a, std::size_t b) {
    if (!belong_together(cloud, config, noise, a, b)) return false;
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
    return true;
  };
  for (int row = 0; row < cloud.height; ++row) {
    for (int col = 0; col < cloud.width; ++col) {
      const std::size_t i = static_cast<std::size_t>(row) * cloud.width + col;
      if (col + 1 < cloud.width && !try_join(i, i + 1) && col + 2 < cloud.width) try_join(i, i + 2);
      if (row + 1 < cloud.height && !try_join(i, i + cloud.width) && row + 2 < cloud.height)
        try_join(i, i + 2 * static_cast<std::size_t>(cloud.width));
    }
  }
  std::vector<int> component(cloud.size(), -1);
  int count = 0;
  for (std::size_t seed = 0; seed < cloud.size(); ++seed) {
    if (cloud.kind[seed] != PixelKind::kObject || component[seed] >= 0) continue;
    std::vector<std::size_t> front{seed};
    component[seed] = count;
    while (!front.empty()) {
      const std::size_t i = front.back();
      front.pop_back();
      for (const std::size_t j : neighbours[i]) {
        if (component[j] >= 0) continue;
        component[j] = count;
        front.push_back(j);
      }
    }
    ++count;
  }
  return component;
}

/// Things of two classes, some touching, in a picture with holes and wrong labels.
Frame speckled_frame(std::uint64_t seed) {
  Frame frame = test::shoot(
      test::room_with({test::solid(test::kBoxClass, {-0.9, 2.2}, {0.5, 0.4, 0.6}),
                       test::solid(test::kBoxClass, {0.3, 2.5}, {0.4, 0.4, 0.8}, 0.3),
                       test::solid(test::kCageClass, {0.75, 2.3}, {0.4, 0.5, 1.0}, -0.2)}),
      test::look_from({0, 0, 1.1}, 0.05 * static_cast<double>(seed)));
  Random random(seed);
  for (int v = 0; v < frame.depth_m.rows; ++v) {
    for (int u = 0; u < frame.depth_m.cols; ++u) {
      float& depth = frame.depth_m.at<float>(v, u);
      auto& label = frame.labels.at<std::uint16_t>(v, u);
      if (random.below(6) == 0) depth = 0.0f;
      if (random.below(25) == 0) label = test::kCageClass;
      if (random.below(20) == 0) depth *= static_cast<float>(random.uniform(0.9, 1.1));
    }
  }
  return frame;
}

TEST(ClustersReference, ComponentsAreThoseOfAFloodFill) {
  PipelineConfig config = test::room_config();
  config.segmentation.stride = 1;
  config.segmentation.min_cluster_area_m2 = 0.0;
  config.segmentation.min_cluster_pixels = 5;
  ThreadPool pool(1);
  int observations = 0, components = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    OrganizedCloud cloud;
    organize(speckled_frame(seed), 1, config.map.max_depth_m, config.classes,
             ClassTable(config.classes), pool, cloud);
    // No ground, no votes: every labelled pixel takes part.
    PlaneSegmentation planes;
    planes.plane_of.assign(cloud.size(), PlaneSegmentation::kNoPlane);
    const std::vector<int> component = flood_fill(cloud, config.segmentation, config.depth_noise);
    const std::vector<PixelKind> kind = cloud.kind;
    Observations found;
    extract_observations(config.segmentation, config.depth_noise, config.map.voxel_size_m, planes,
                         cloud, found);

    std::map<int, int> pixels;
    std::map<int, std::set<std::int32_t>> seen_as;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (kind[i] != PixelKind::kObject) continue;
      ++pixels[component[i]];
      seen_as[component[i]].insert(found.observation_of[i]);
    }
    std::set<std::int32_t> used;
    for (const auto& [c, as] : seen_as) {
      ASSERT_EQ(as.size(), 1u) << "seed " << seed << ": component " << c << " was cut";
      const bool large = pixels[c] >= config.segmentation.min_cluster_pixels;
      EXPECT_EQ(*as.begin() != Observations::kNone, large) << "seed " << seed;
      if (large) ++components;
      used.insert(*as.begin());
    }
    used.erase(Observations::kNone);
    EXPECT_EQ(used.size(), found.list.size());
    observations += static_cast<int>(found.list.size());
  }
  // Components are joined only where their boxes overlap; so some stay apart.
  EXPECT_GT(components, 40);
  EXPECT_GT(observations, 6 * 3);
  EXPECT_LE(observations, components);
}

TEST(ClustersReference, ThinnedPointsAreTheMeansOfTheirCells) {
  const PipelineConfig config = test::room_config();
  const test::Segmented s = test::segment(
      test::shoot(test::room_with({test::solid(test::kBoxClass, {0.0, 3.0}, {0.9, 0.4, 0.9})}),
                  test::look_from({0, 0, 1.1})),
      config);
  ASSERT_EQ(s.observations.list.size(), 1u);
  // At 3 m a cell of 5 cm is about two pixels of the grid: every pixel is looked at.
  const double spacing = config.map.voxel_size_m;
  std::map<std::array<int, 3>, std::pair<Eigen::Vector3d, int>> cells;
  for (std::size_t i = 0; i < s.cloud.size(); ++i) {
    if (s.observations.observation_of[i] != 0 || s.cloud.kind[i] != PixelKind::kObject) continue;
    const Eigen::Vector3f p = s.cloud.point_W(i);
    const auto cell = [&](float v) {
      return static_cast<int>(std::floor(v * static_cast<float>(1.0 / spacing)));
    };
    auto& sum = cells
                    .try_emplace({cell(p.x()), cell(p.y()), cell(p.z())},
                                 std::pair{Eigen::Vector3d::Zero().eval(), 0})
                    .first->second;
    sum.first += p.cast<double>();
    ++sum.second;
  }
  const auto& points = s.observations.list[0].points;
  ASSERT_EQ(points.size(), cells.size());
  for (const auto& entry : cells) {
    const Eigen::Vector3d mean = entry.second.first / entry.second.second;
    double nearest = 1e9;
    for (const SurfacePoint& p : points) {
      nearest = std::min(nearest, (p.point_W.cast<double>() - mean).norm());
    }
    EXPECT_LT(nearest, 1e-5);  // sums of a few dozen floats of a few metres
  }
}

TEST(CellIndex, HoldsWhatAMapHolds) {
  Random random(5);
  CellIndex index;
  for (int round = 0; round < 3; ++round) {
    std::map<std::uint64_t, std::int32_t> map;
    index.clear();
    for (std::int32_t i = 0; i < 5000; ++i) {
      const auto axis = [&] { return static_cast<std::int64_t>(random.below(24)) - 12; };
      const std::uint64_t key = cell_key(axis(), axis(), axis());
      EXPECT_EQ(index.insert(key, i), map.try_emplace(key, i).first->second);
    }
    EXPECT_EQ(index.size(), map.size());
    for (std::int64_t x = -13; x < 13; ++x) {
      const std::uint64_t key = cell_key(x, 0, 3);
      const auto entry = map.find(key);
      EXPECT_EQ(index.find(key), entry == map.end() ? CellIndex::kNone : entry->second);
    }
  }
}

TEST(Rounding, IsThatOfTheLibrary) {
  Random random(6);
  for (int i = 0; i < 100000; ++i) {
    const auto value = static_cast<float>(random.uniform(-3000.0, 3000.0));
    EXPECT_EQ(round_to_int(value), std::lround(value));
  }
  for (const float value :
       {0.5f, -0.5f, 0.49999997f, -0.49999997f, 1.5f, 2.5f, -2.5f, 8388607.5f, -8388607.5f, 0.0f}) {
    EXPECT_EQ(round_to_int(value), std::lround(value)) << value;
  }
}

}  // namespace
}  // namespace pocd

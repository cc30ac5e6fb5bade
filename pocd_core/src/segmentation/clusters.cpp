#include "clusters.hpp"

#include <algorithm>
#include <numeric>

#include "pocd/common/kernel.hpp"

namespace pocd {
namespace {

/// Which neighbours a pixel is joined with. A farther one is asked only where the nearer is not.
constexpr std::int32_t kRight = 1, kRight2 = 2, kDown = 4, kDown2 = 8;

/// Squared distance up to which neighbours of a pixel at `depth` belong with it.
POCD_KERNEL void square_limits(const float* __restrict depth, int count, float tolerance,
                               float pixel_angle, double base, double quadratic,
                               float* __restrict limit2) {
  for (int i = 0; i < count; ++i) {
    const float z = depth[i];
    const double zd = z;
    const float sigma = static_cast<float>(base + quadratic * zd * zd);
    const float limit = tolerance + 2.0f * pixel_angle * z + 2.0f * sigma;
    limit2[i] = limit * limit;
  }
}

/// links |= bit where pixel i and pixel i + step are of one kind and near each other, except where
/// a bit of `unless` is set.
POCD_KERNEL void link(const float* __restrict x, const float* __restrict y,
                      const float* __restrict z, const float* __restrict limit2,
                      const std::uint32_t* __restrict key, int count, int step, std::int32_t bit,
                      std::int32_t unless, std::int32_t* __restrict links) {
  for (int i = 0; i < count; ++i) {
    const float dx = x[i] - x[i + step], dy = y[i] - y[i + step], dz = z[i] - z[i + step];
    const float d2 = dx * dx + dy * dy + dz * dz;
    const std::int32_t near = d2 < limit2[i] ? bit : 0;
    const std::int32_t alike = key[i] == key[i + step] ? -1 : 0;
    const std::int32_t object = limit2[i + step] >= 0.0f ? -1 : 0;
    const std::int32_t free = (links[i] & unless) == 0 ? -1 : 0;
    links[i] |= near & alike & object & free;
  }
}

void find_links(const OrganizedCloud& cloud, const SegmentationConfig& config,
                const DepthNoise& noise, ClusterMemory& memory) {
  const int width = cloud.width, height = cloud.height;
  const std::size_t size = cloud.size();
  memory.key.resize(size);
  memory.limit2.resize(size);
  memory.links.assign(size, 0);
  square_limits(cloud.depth_m.data(), static_cast<int>(size),
                static_cast<float>(config.cluster_tolerance_m),
                static_cast<float>(1.0 / cloud.camera.fx), noise.base_m, noise.quadratic_per_m,
                memory.limit2.data());
  for (std::size_t i = 0; i < size; ++i) {
    memory.key[i] = static_cast<std::uint32_t>(cloud.label[i]) << 16 | cloud.instance[i];
    if (cloud.kind[i] != PixelKind::kObject) memory.limit2[i] = -1.0f;
  }
  for (int row = 0; row < height; ++row) {
    const std::size_t at = static_cast<std::size_t>(row) * width;
    const auto try_link = [&](int count, int step, std::int32_t bit, std::int32_t unless) {
      if (count <= 0) return;
      link(cloud.x_W.data() + at, cloud.y_W.data() + at, cloud.z_W.data() + at,
           memory.limit2.data() + at, memory.key.data() + at, count, step, bit, unless,
           memory.links.data() + at);
    };
    try_link(width - 1, 1, kRight, 0);
    try_link(width - 2, 2, kRight2, kRight);
    if (row + 1 < height) try_link(width, width, kDown, 0);
    if (row + 2 < height) try_link(width, 2 * width, kDown2, kDown);
  }
}

std::int32_t find_root(std::vector<std::int32_t>& parent, std::int32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/// The root is the smallest index, so labels do not depend on the order of joins.
void join(std::vector<std::int32_t>& parent, std::int32_t a, std::int32_t b) {
  if (a == b) return;
  a = find_root(parent, a), b = find_root(parent, b);
  parent[std::max(a, b)] = std::min(a, b);
}

/// Cuts the rows into runs of pixels that are joined to their right neighbours, and joins the runs.
void join_runs(const OrganizedCloud& cloud, ClusterMemory& memory) {
  const std::int32_t width = cloud.width;
  const auto size = static_cast<std::int32_t>(cloud.size());
  const float* const limit2 = memory.limit2.data();
  const std::int32_t* const links = memory.links.data();
  memory.run_of.resize(cloud.size());
  memory.first_of.clear();
  memory.end_of.clear();
  for (std::int32_t i = 0; i < size; ++i) {
    if (limit2[i] < 0.0f) continue;
    const auto run = static_cast<std::int32_t>(memory.first_of.size());
    memory.first_of.push_back(i);
    memory.run_of[i] = run;
    while (links[i] & kRight) memory.run_of[++i] = run;  // no link leaves its row
    memory.end_of.push_back(i + 1);
  }
  memory.parent.resize(memory.first_of.size());
  std::iota(memory.parent.begin(), memory.parent.end(), 0);
  for (std::size_t r = 0; r < memory.parent.size(); ++r) {
    const auto run = static_cast<std::int32_t>(r);
    // Neighbouring pixels mostly lead to the same run again.
    std::int32_t last = run;
    const auto join_with = [&](std::int32_t other) {
      if (other != last) join(memory.parent, run, other);
      last = other;
    };
    for (std::int32_t i = memory.first_of[r]; i < memory.end_of[r]; ++i) {
      if (links[i] & kRight2) join_with(memory.run_of[i + 2]);
      if (links[i] & kDown) join_with(memory.run_of[i + width]);
      if (links[i] & kDown2) join_with(memory.run_of[i + 2 * width]);
    }
  }
}

}  // namespace

std::vector<Cluster> find_clusters(const OrganizedCloud& cloud, const SegmentationConfig& config,
                                   const DepthNoise& noise, ClusterMemory& memory) {
  find_links(cloud, config, noise, memory);
  join_runs(cloud, memory);

  // First only counted: most components are specks that are dropped.
  const std::size_t runs = memory.parent.size();
  std::size_t components = 0;
  memory.component.resize(runs);
  for (std::size_t run = 0; run < runs; ++run) {
    const std::int32_t root = find_root(memory.parent, static_cast<std::int32_t>(run));
    memory.component[run] = static_cast<std::size_t>(root) == run
                                ? static_cast<std::int32_t>(components++)
                                : memory.component[root];
  }
  std::vector<ClusterMemory::Component>& all = memory.components;
  all.assign(components, {});
  const double pixel_area = 1.0 / (cloud.camera.fx * cloud.camera.fy);
  for (std::size_t run = 0; run < runs; ++run) {
    ClusterMemory::Component& component = all[memory.component[run]];
    const std::int32_t first = memory.first_of[run], end = memory.end_of[run];
    if (component.pixels == 0) component.first = first;
    component.pixels += end - first;
    double area_m2 = component.area_m2;
    for (std::int32_t i = first; i < end; ++i) {
      const double z = cloud.depth_m[i];
      area_m2 += z * z * pixel_area;
    }
    component.area_m2 = area_m2;
  }
  // Those that stay get new numbers; the others none.
  std::vector<Cluster> clusters;
  clusters.reserve(cloud.size() / static_cast<std::size_t>(config.min_cluster_pixels) + 1);
  for (ClusterMemory::Component& component : all) {
    if (component.pixels < config.min_cluster_pixels ||
        component.area_m2 < config.min_cluster_area_m2) {
      continue;
    }
    component.kept = static_cast<std::int32_t>(clusters.size());
    Cluster& cluster = clusters.emplace_back();
    cluster.class_id = cloud.label[component.first];
    cluster.instance = cloud.instance[component.first];
    cluster.pixels = component.pixels;
    cluster.area_m2 = component.area_m2;
    if (memory.members.empty()) memory.members.emplace_back();
    cluster.members = std::move(memory.members.back());
    memory.members.pop_back();
    cluster.members.clear();
    cluster.members.reserve(static_cast<std::size_t>(cluster.pixels));
  }
  for (std::size_t run = 0; run < runs; ++run) {
    const std::int32_t kept = all[memory.component[run]].kept;
    if (kept < 0) continue;
    std::vector<std::int32_t>& members = clusters[kept].members;
    for (std::int32_t i = memory.first_of[run]; i < memory.end_of[run]; ++i) members.push_back(i);
  }
  return clusters;
}

}  // namespace pocd

#include "pocd/registration/icp_target.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

// Bounds the memory of level 0 (4 bytes a cell) for very long objects; their cells get larger.
constexpr double kMaxCells = 1 << 20;
constexpr int kBorder = 2;

// The 3 x 3 rows of cells around a query, nearest first, so that the later ones are mostly skipped.
constexpr std::array<std::array<int, 2>, 9> kRows = {
    {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};

float square(float x) { return x * x; }
float just_beyond(float x) { return std::nextafter(x, 2.0f * x); }

}  // namespace

Eigen::Array3i IcpTarget::Level::cell_of(const Eigen::Vector3f& point) const {
  // Bounded before the conversion: a query may be anywhere.
  return (point.array() / cell_m).floor().max(-1e6f).min(1e6f).cast<int>() + kBorder;
}

IcpTarget::Level IcpTarget::make_level(const std::vector<Eigen::Vector3f>& points,
                                       const std::vector<Eigen::Vector3f>& normals, float cell_m) {
  Level level;
  level.cell_m = cell_m;
  Eigen::Array3f extent = Eigen::Array3f::Zero();
  for (const auto& p : points) extent = extent.max(p.array());
  level.cells = (extent / cell_m).floor().cast<int>() + 1 + 2 * kBorder;

  // Counting sort by cell; within a cell the input's order stays.
  std::vector<std::uint32_t> cell(points.size());
  level.begin.assign(level.cells.prod() + 1, 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    cell[i] = static_cast<std::uint32_t>(level.flat_index(level.cell_of(points[i])));
    ++level.begin[cell[i] + 1];
  }
  for (std::size_t c = 1; c < level.begin.size(); ++c) level.begin[c] += level.begin[c - 1];
  std::vector<std::uint32_t> next(level.begin.begin(), level.begin.end() - 1);
  level.points.resize(points.size());
  level.normals.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t slot = next[cell[i]]++;
    level.points[slot] = points[i];
    level.normals[slot] = normals[i];
  }
  level.note_rows();
  return level;
}

void IcpTarget::Level::note_rows() {
  rows.assign(begin.size() - 1, 0);
  std::array<int, kRows.size()> step;  // from a cell to the middle of its n-th row
  for (std::size_t n = 0; n < kRows.size(); ++n) {
    step[n] = (kRows[n][1] * cells.y() + kRows[n][0]) * cells.x();
  }
  for (std::size_t c = 0; c < rows.size(); ++c) {
    if (begin[c] == begin[c + 1]) continue;
    for (std::size_t n = 0; n < kRows.size(); ++n) {
      // The border keeps the cells around a point within the grid.
      const std::size_t around = c - static_cast<std::size_t>(static_cast<std::ptrdiff_t>(step[n]));
      const auto bit = static_cast<std::uint16_t>(1u << n);
      for (const std::size_t cell : {around - 1, around, around + 1}) {
        rows[cell] = static_cast<std::uint16_t>(rows[cell] | bit);
      }
    }
  }
}

IcpTarget::IcpTarget(const Points& points_W, const Points& normals_W, double inlier_distance_m,
                     double max_correspondence_m)
    : inlier_distance_m_(inlier_distance_m), max_correspondence_m_(max_correspondence_m) {
  POCD_CHECK(!points_W.empty() && points_W.size() == normals_W.size());
  POCD_CHECK(inlier_distance_m > 0.0 && max_correspondence_m >= inlier_distance_m);
  Eigen::Vector3f low = points_W.front(), high = points_W.front();
  for (const auto& p : points_W) {
    POCD_CHECK(p.allFinite());
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  origin_W_ = low.cast<double>();
  std::vector<Eigen::Vector3f> points;
  points.reserve(points_W.size());
  for (const auto& p : points_W) points.push_back(p - low);

  double cell_m = inlier_distance_m;
  const Eigen::Array3d size_m = (high - low).cast<double>().array();
  while ((size_m / cell_m + 1 + 2 * kBorder).prod() > kMaxCells) cell_m *= 1.25;

  levels_.push_back(make_level(points, normals_W, static_cast<float>(cell_m)));
  while (levels_.back().cell_m < max_correspondence_m) {
    const Level& below = levels_.back();
    std::vector<Eigen::Vector3f> fewer, fewer_normals;
    fewer.reserve(below.points.size());
    fewer_normals.reserve(below.points.size());
    for (std::size_t c = 0; c + 1 < below.begin.size(); ++c) {
      if (below.begin[c] == below.begin[c + 1]) continue;
      // The middle one of the cell in input order: as good as any, and always the same.
      const std::uint32_t i = (below.begin[c] + below.begin[c + 1]) / 2;
      fewer.push_back(below.points[i]);
      fewer_normals.push_back(below.normals[i]);
    }
    levels_.push_back(make_level(fewer, fewer_normals, 2.0f * below.cell_m));
  }
}

std::uint32_t IcpTarget::search(const Level& level, const Eigen::Vector3f& query, float& nearest2) {
  // What cell_of() does, four at a time, for the sake of vector instructions.
  const Eigen::Array4f point(query.x(), query.y(), query.z(), 0.0f);
  const Eigen::Array4f floor = (point / level.cell_m).floor().max(-1e6f).min(1e6f);
  const Eigen::Array4i cell = floor.cast<int>() + kBorder;
  const bool inside = cell.x() >= 1 && cell.y() >= 1 && cell.z() >= 1 &&
                      cell.x() <= level.cells.x() - 2 && cell.y() <= level.cells.y() - 2 &&
                      cell.z() <= level.cells.z() - 2;
  if (!inside) return kNone;
  const int center = level.flat_index(cell.head<3>());
  if (level.rows[static_cast<std::size_t>(center)] == 0) return kNone;
  const Eigen::Array4f below = point - floor * level.cell_m;
  const Eigen::Array4f above = level.cell_m - below;
  const float y0 = square(below.y()), y2 = square(above.y());
  const float z0 = square(below.z()), z2 = square(above.z());
  const int y = level.cells.x(), z = level.cells.x() * level.cells.y();
  // In the order of kRows: how far a row is from the query at least, and where its middle is.
  const float gap[] = {0.0f, y0, y2, z0, z2, y0 + z0, y2 + z0, y0 + z2, y2 + z2};
  const int step[] = {0, -y, y, -z, z, -y - z, y - z, z - y, y + z};
  const std::uint32_t* const begin = level.begin.data() + center;
  const Eigen::Vector3f* const points = level.points.data();
  std::uint32_t found = kNone;
  float nearest = nearest2;
  for (unsigned rows = level.rows[static_cast<std::size_t>(center)]; rows != 0; rows &= rows - 1) {
    const int n = __builtin_ctz(rows);
    if (gap[n] >= nearest) continue;
    const std::ptrdiff_t middle = step[n];
    const std::uint32_t end = begin[middle + 2];
    for (std::uint32_t i = begin[middle - 1]; i < end; ++i) {
      const float d2 = (points[i] - query).squaredNorm();
      const bool closer = d2 < nearest;
      nearest = closer ? d2 : nearest;
      found = closer ? i : found;
    }
  }
  nearest2 = nearest;
  return found;
}

std::optional<IcpTarget::Neighbour> IcpTarget::nearest_inlier(const Eigen::Vector3f& query) const {
  const double limit2 = inlier_distance_m_ * inlier_distance_m_;
  // A little more, so that no rounding leaves one out.
  float nearest2 = static_cast<float>(1.001 * limit2);
  const Level& level = levels_.front();  // has all points, in cells that are not smaller
  const std::uint32_t found = search(level, query, nearest2);
  if (found == kNone || nearest2 > limit2) return std::nullopt;
  return Neighbour{level.points[found], level.normals[found], nearest2};
}

std::optional<IcpTarget::Neighbour> IcpTarget::nearest(const Eigen::Vector3f& query) const {
  // Points on the limit itself belong to it.
  float nearest2 = just_beyond(square(static_cast<float>(max_correspondence_m_)));
  const Level* level_of = nullptr;
  std::uint32_t found = kNone;
  for (const Level& level : levels_) {
    const std::uint32_t here = search(level, query, nearest2);
    if (here != kNone) found = here, level_of = &level;
    // Whatever is within one cell has been seen by the search of the 3 x 3 x 3 neighbourhood.
    if (nearest2 <= square(level.cell_m)) break;
  }
  if (level_of == nullptr) return std::nullopt;
  return Neighbour{level_of->points[found], level_of->normals[found], nearest2};
}

}  // namespace pocd

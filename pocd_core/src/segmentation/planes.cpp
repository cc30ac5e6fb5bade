#include "pocd/segmentation/planes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>

#include "pocd/common/kernel.hpp"

namespace pocd {
namespace {

/// Sums for the fit of 1/z = a x + b y + c, x = (u - cx) / fx, y = (v - cy) / fy. (a, b, c) is the
/// plane's normal in the optical frame over its distance from the camera.
struct InverseDepthFit {
  double xx = 0, xy = 0, yy = 0, x = 0, y = 0, n = 0;
  double rx = 0, ry = 0, r = 0, rr = 0;

  void add(double px, double py, double rho) {
    xx += px * px, xy += px * py, yy += py * py, x += px, y += py, n += 1;
    rx += rho * px, ry += rho * py, r += rho, rr += rho * rho;
  }
  void add(const InverseDepthFit& o) {
    xx += o.xx, xy += o.xy, yy += o.yy, x += o.x, y += o.y, n += o.n;
    rx += o.rx, ry += o.ry, r += o.r, rr += o.rr;
  }
  /// False when the pixels span no area.
  bool solve(Eigen::Vector3d& abc, double& rms) const {
    // Centred, so that the 2 x 2 system is well conditioned far from the image centre too.
    const double mx = x / n, my = y / n, mr = r / n;
    const double cxx = xx / n - mx * mx, cxy = xy / n - mx * my, cyy = yy / n - my * my;
    const double crx = rx / n - mr * mx, cry = ry / n - mr * my;
    const double det = cxx * cyy - cxy * cxy;
    if (!(det > 1e-14)) return false;
    const double a = (crx * cyy - cry * cxy) / det;
    const double b = (cry * cxx - crx * cxy) / det;
    abc = {a, b, mr - a * mx - b * my};
    const double var = rr / n - mr * mr - a * crx - b * cry;
    rms = std::sqrt(std::max(0.0, var));
    return true;
  }
};

struct Cell {
  InverseDepthFit fit;
  Eigen::Vector3f normal_C;  ///< towards the camera
  float offset_m = 0.0f;     ///< normal_C . p
  Eigen::Vector3f centroid_C;
  float tolerance_m = 0.0f;
  bool planar = false;
};

bool finish(Cell& cell, double tolerance_m, const DepthNoise& noise) {
  constexpr double kMinReturns = PlaneSegmentation::kCellSide * PlaneSegmentation::kCellSide / 4.0;
  Eigen::Vector3d abc;
  double rms = 0.0;
  if (cell.fit.n < kMinReturns || !cell.fit.solve(abc, rms)) return false;
  const double z = cell.fit.n / cell.fit.r;
  const double sigma = noise.sigma(z);
  // An error dz of depth is dz / z^2 of inverse depth.
  if (rms * z * z > 2.0 * sigma + 0.5 * tolerance_m) return false;
  const double norm = abc.norm();
  if (!(norm > 1e-9)) return false;
  cell.normal_C = (-abc / norm).cast<float>();
  cell.offset_m = static_cast<float>(-1.0 / norm);
  cell.centroid_C =
      Eigen::Vector3d(cell.fit.x / cell.fit.n * z, cell.fit.y / cell.fit.n * z, z).cast<float>();
  cell.tolerance_m = static_cast<float>(tolerance_m + 3.0 * sigma);
  return true;
}

/// Distance to a plane up to which a pixel of that depth lies on it.
POCD_KERNEL void tolerances(const float* __restrict depth, int count, double tolerance_m,
                            double base, double quadratic, float* __restrict out) {
  for (int i = 0; i < count; ++i) {
    const double z = depth[i];
    out[i] = static_cast<float>(tolerance_m + 3.0 * (base + quadratic * z * z));
  }
}

/// Height of each point above a plane that faces up, and the height up to which it is ground.
POCD_KERNEL void heights(const float* __restrict x, const float* __restrict y,
                         const float* __restrict z, const float* __restrict depth, int count,
                         const float* __restrict normal, float offset, float camera_z, float band,
                         double base, double quadratic, float* __restrict height,
                         float* __restrict spread) {
  const float nx = normal[0], ny = normal[1], nz = normal[2];
  for (int i = 0; i < count; ++i) {
    const double d = depth[i];
    const float sigma = static_cast<float>(base + quadratic * d * d);
    // Noise acts along the ray; what counts is its vertical part.
    const float slope = std::abs(z[i] - camera_z) / depth[i];
    height[i] = nx * x[i] + (ny * y[i] + nz * z[i]) - offset;
    spread[i] = band + slope * sigma;
  }
}

int find_root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

void segment_planes(const OrganizedCloud& cloud, const SegmentationConfig& config,
                    const DepthNoise& noise, PlaneSegmentation& out) {
  constexpr int kSide = PlaneSegmentation::kCellSide;
  const int cols = (cloud.width + kSide - 1) / kSide, rows = (cloud.height + kSide - 1) / kSide;
  std::vector<Cell> cells(static_cast<std::size_t>(cols) * rows);
  const double fx = cloud.camera.fx, fy = cloud.camera.fy, cx = cloud.camera.cx,
               cy = cloud.camera.cy;
  std::vector<double> column(cloud.width);
  for (int col = 0; col < cloud.width; ++col) column[col] = (col - cx) / fx;
  for (int row = 0; row < cloud.height; ++row) {
    const double y = (row - cy) / fy;
    const std::size_t at = static_cast<std::size_t>(row) * cloud.width;
    for (int first = 0; first < cloud.width; first += kSide) {
      // In registers for the pixels of one cell in this row.
      InverseDepthFit fit = cells[(row / kSide) * cols + first / kSide].fit;
      const int last = std::min(first + kSide, cloud.width);
      for (int col = first; col < last; ++col) {
        if (cloud.kind[at + col] == PixelKind::kNone) continue;
        fit.add(column[col], y, 1.0 / cloud.depth_m[at + col]);
      }
      cells[(row / kSide) * cols + first / kSide].fit = fit;
    }
  }
  for (Cell& cell : cells) cell.planar = finish(cell, config.plane_tolerance_m, noise);

  std::vector<int> parent(cells.size());
  std::iota(parent.begin(), parent.end(), 0);
  const float min_cos = static_cast<float>(std::cos(config.plane_max_angle_deg * M_PI / 180.0));
  const auto join = [&](int a, int b) {
    const Cell &p = cells[a], &q = cells[b];
    if (!p.planar || !q.planar || p.normal_C.dot(q.normal_C) < min_cos) return;
    const float gap = std::max(std::abs(p.normal_C.dot(q.centroid_C) - p.offset_m),
                               std::abs(q.normal_C.dot(p.centroid_C) - q.offset_m));
    if (gap > std::max(p.tolerance_m, q.tolerance_m)) return;
    const int ra = find_root(parent, a), rb = find_root(parent, b);
    parent[std::max(ra, rb)] = std::min(ra, rb);
  };
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      const int i = row * cols + col;
      if (col + 1 < cols) join(i, i + 1);
      if (row + 1 < rows) join(i, i + cols);
    }
  }

  // Refit every plane over all its cells.
  out.planes.clear();
  std::vector<Cell> sums(cells.size());
  std::vector<std::uint16_t> plane_of_cell(cells.size(), PlaneSegmentation::kNoPlane);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].planar) sums[find_root(parent, static_cast<int>(i))].fit.add(cells[i].fit);
  }
  std::vector<Cell> plane_cells;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    // A far, wide plane may bend by lens error; accept it all the same, with the cells' own
    // tolerance.
    if (!cells[i].planar || find_root(parent, static_cast<int>(i)) != static_cast<int>(i)) continue;
    Cell& sum = sums[i];
    sum.planar = finish(sum, config.plane_tolerance_m, noise);
    if (!sum.planar) continue;
    plane_of_cell[i] = static_cast<std::uint16_t>(plane_cells.size());
    plane_cells.push_back(sum);
    const Eigen::Vector3f normal_W = cloud.T_W_C.linear().cast<float>() * sum.normal_C;
    const Eigen::Vector3f centroid_W = (cloud.T_W_C * sum.centroid_C.cast<double>()).cast<float>();
    // The centroid of inverse depths lies off the plane; the offset comes from the fit.
    const float offset_m = sum.offset_m + normal_W.dot(cloud.T_W_C.translation().cast<float>());
    out.planes.push_back({normal_W, offset_m, centroid_W, 0});
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].planar) plane_of_cell[i] = plane_of_cell[find_root(parent, static_cast<int>(i))];
  }

  out.plane_of.assign(cloud.size(), PlaneSegmentation::kNoPlane);
  std::vector<float> tolerance(cloud.size());
  tolerances(cloud.depth_m.data(), static_cast<int>(cloud.size()), config.plane_tolerance_m,
             noise.base_m, noise.quadratic_per_m, tolerance.data());
  for (int row = 0; row < cloud.height; ++row) {
    const int r = row / kSide;
    for (int c = 0; c < cols; ++c) {
      const std::array<int, 5> near{
          r * cols + c, r > 0 ? (r - 1) * cols + c : -1, r + 1 < rows ? (r + 1) * cols + c : -1,
          c > 0 ? r * cols + c - 1 : -1, c + 1 < cols ? r * cols + c + 1 : -1};
      const std::size_t first = static_cast<std::size_t>(row) * cloud.width + c * kSide;
      const std::size_t last = first + std::min(kSide, cloud.width - c * kSide);
      for (std::size_t i = first; i < last; ++i) {
        if (cloud.kind[i] == PixelKind::kNone) continue;
        const Eigen::Vector3f p_W = cloud.point_W(i);
        float best = tolerance[i];
        std::uint16_t best_plane = PlaneSegmentation::kNoPlane;
        for (const int cell : near) {
          if (cell < 0 || plane_of_cell[cell] == PlaneSegmentation::kNoPlane) continue;
          const Plane& plane = out.planes[plane_of_cell[cell]];
          const float gap = std::abs(plane.normal_W.dot(p_W) - plane.offset_m);
          if (gap < best) {
            best = gap;
            best_plane = plane_of_cell[cell];
          }
          if (cell == near[0] && best < tolerance[i]) break;  // its own cell's plane fits
        }
        if (best_plane == PlaneSegmentation::kNoPlane) continue;
        out.plane_of[i] = best_plane;
        ++out.planes[best_plane].pixels;
      }
    }
  }
}

namespace {

struct ClassCount {
  ClassId label;
  PixelKind kind;
  int count;
};

/// Most frequent class of each plane with the number of its voting pixels.
struct PlaneVotes {
  std::vector<std::vector<ClassCount>> counts;
  std::vector<int> voters;
  /// Of a plane << 16 | class: index in counts, beyond the first few.
  std::unordered_map<std::uint32_t, std::size_t> place_of;

  const ClassCount* winner(std::size_t plane) const {
    const ClassCount* best = nullptr;
    for (const ClassCount& c : counts[plane]) {
      if (!best || c.count > best->count || (c.count == best->count && c.label < best->label))
        best = &c;
    }
    return best;
  }
};

bool votes(PixelKind kind) {
  return kind == PixelKind::kGround || kind == PixelKind::kBackground || kind == PixelKind::kObject;
}

/// Counts of one plane; few classes are found by looking through them, a mask of noise by a table.
ClassCount& count_of(PlaneVotes& votes, std::uint16_t plane, ClassId label, PixelKind kind) {
  constexpr std::size_t kFew = 16;
  std::vector<ClassCount>& counts = votes.counts[plane];
  const std::size_t few = std::min(kFew, counts.size());
  for (std::size_t k = 0; k < few; ++k) {
    if (counts[k].label == label) return counts[k];
  }
  if (few == kFew) {
    const auto key = static_cast<std::uint32_t>(plane) << 16 | label;
    const auto [it, fresh] = votes.place_of.try_emplace(key, counts.size());
    if (!fresh) return counts[it->second];
  }
  counts.push_back({label, kind, 0});
  return counts.back();
}

PlaneVotes count_votes(const PlaneSegmentation& planes, const OrganizedCloud& cloud) {
  PlaneVotes result;
  result.counts.resize(planes.planes.size());
  result.voters.resize(planes.planes.size());
  // Neighbours mostly lie on one plane and carry one class: counted by runs of such.
  const std::size_t size = cloud.size();
  for (std::size_t i = 0; i < size;) {
    const std::uint16_t plane = planes.plane_of[i];
    if (plane == PlaneSegmentation::kNoPlane || !votes(cloud.kind[i])) {
      ++i;
      continue;
    }
    const std::size_t first = i;
    const ClassId label = cloud.label[i];
    do {
      ++i;
    } while (i < size && planes.plane_of[i] == plane && cloud.label[i] == label &&
             votes(cloud.kind[i]));
    const auto run = static_cast<int>(i - first);
    result.voters[plane] += run;
    count_of(result, plane, label, cloud.kind[first]).count += run;
  }
  return result;
}

/// Height of the pixels of a ground class where nearly all agree within `band_m` [m, W]: a strip at
/// the image's edge is too little for a plane, but a thing's ragged foot is not to be joined over
/// it with the next one's.
std::optional<float> ground_class_level(const OrganizedCloud& cloud, float band_m) {
  constexpr double kLeastShare = 0.00086;  // of all pixels: 50 of 640x360 at every other one
  constexpr double kShare = 0.9;
  const float camera_z = static_cast<float>(cloud.T_W_C.translation().z());
  std::vector<float> z;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.kind[i] == PixelKind::kGround) z.push_back(cloud.z_W[i]);
  }
  if (static_cast<double>(z.size()) < kLeastShare * static_cast<double>(cloud.size()))
    return std::nullopt;
  const auto middle = z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2);
  std::nth_element(z.begin(), middle, z.end());
  const float level = *middle;
  if (level >= camera_z) return std::nullopt;
  const auto near =
      std::count_if(z.begin(), z.end(), [&](float v) { return std::abs(v - level) <= band_m; });
  if (static_cast<double>(near) < kShare * static_cast<double>(z.size())) return std::nullopt;
  return level;
}

}  // namespace

void vote_planes(const PlaneSegmentation& planes, double majority_share, OrganizedCloud& cloud) {
  const PlaneVotes tally = count_votes(planes, cloud);
  std::vector<const ClassCount*> verdict(planes.planes.size(), nullptr);
  for (std::size_t p = 0; p < verdict.size(); ++p) {
    const ClassCount* best = tally.winner(p);
    if (best && best->count >= majority_share * tally.voters[p]) verdict[p] = best;
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint16_t plane = planes.plane_of[i];
    if (plane == PlaneSegmentation::kNoPlane || !verdict[plane] || !votes(cloud.kind[i])) continue;
    cloud.label[i] = verdict[plane]->label;
    cloud.kind[i] = verdict[plane]->kind;
  }
}

void GroundModel::update(const PlaneSegmentation& planes, const SegmentationConfig& config,
                         const DepthNoise& noise, OrganizedCloud& cloud) {
  constexpr int kStrip = 4;  // times the least pixels: a smaller plane is a strip
  const PlaneVotes tally = count_votes(planes, cloud);
  const float min_up = static_cast<float>(std::cos(config.ground_max_tilt_deg * M_PI / 180.0));
  const int min_pixels =
      static_cast<int>(config.ground_min_share * static_cast<double>(cloud.size()));
  const float camera_z = static_cast<float>(cloud.T_W_C.translation().z());
  const Plane* best = nullptr;
  bool best_class = false;
  for (std::size_t p = 0; p < planes.planes.size(); ++p) {
    const Plane& plane = planes.planes[p];
    if (plane.normal_W.z() < min_up || plane.pixels < min_pixels ||
        plane.centroid_W.z() >= camera_z)
      continue;
    const ClassCount* winner = tally.winner(p);
    const bool is_class = winner && winner->kind == PixelKind::kGround;
    const bool better = !best || (is_class && !best_class) ||
                        (is_class == best_class && plane.centroid_W.z() < best->centroid_W.z());
    if (better) best = &plane, best_class = is_class;
  }
  // A plane that was found by its looks alone replaces a known ground only when it lies at or below
  // it: a table top is not the floor because the floor is out of view.
  const float x = best ? best->centroid_W.x() : 0.0f, y = best ? best->centroid_W.y() : 0.0f;
  const bool take =
      best &&
      (!known_ || (best_class && !from_class_) ||
       (best_class == from_class_ &&
        (best_class || best->centroid_W.z() <
                           height_at(x, y) + 2.0f * static_cast<float>(config.ground_band_m))));
  if (take) {
    known_ = true;
    from_class_ = best_class;
    normal_W_ = best->normal_W;
    offset_m_ = best->offset_m;
    level_m_ = height_at(x, y);
    is_strip_ = best->pixels < kStrip * min_pixels;
  } else if (is_strip_) {
    // The tilt of a strip at the image's edge says nothing of the floor elsewhere.
    normal_W_ = Eigen::Vector3f::UnitZ();
    offset_m_ = level_m_;
  }
  if (!known_) {
    if (const auto level =
            ground_class_level(cloud, 2.0f * static_cast<float>(config.ground_band_m))) {
      // A level is less than a plane: a floor that is found takes over, whatever tells it.
      known_ = true;
      from_class_ = false;
      normal_W_ = Eigen::Vector3f::UnitZ();
      offset_m_ = level_m_ = *level;
      is_strip_ = true;
    }
  }
  const float band = static_cast<float>(config.ground_band_m);
  const float ceiling = static_cast<float>(config.max_height_m);
  if (!known_) return;
  std::vector<float> height(cloud.size()), spread(cloud.size());
  heights(cloud.x_W.data(), cloud.y_W.data(), cloud.z_W.data(), cloud.depth_m.data(),
          static_cast<int>(cloud.size()), normal_W_.data(), offset_m_, camera_z, band, noise.base_m,
          noise.quadratic_per_m, height.data(), spread.data());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    PixelKind& kind = cloud.kind[i];
    if (!votes(kind)) continue;
    if (height[i] < spread[i]) {
      kind = PixelKind::kGround;
    } else if (kind == PixelKind::kGround || (height[i] > ceiling && kind == PixelKind::kObject)) {
      kind = PixelKind::kBackground;
    }
  }
}

}  // namespace pocd

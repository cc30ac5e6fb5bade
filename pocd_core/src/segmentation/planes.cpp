#include "pocd/segmentation/planes.hpp"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <numeric>

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
  for (int row = 0; row < cloud.height; ++row) {
    const double y = (row - cy) / fy;
    for (int col = 0; col < cloud.width; ++col) {
      const std::size_t i = static_cast<std::size_t>(row) * cloud.width + col;
      if (cloud.kind[i] == PixelKind::kNone) continue;
      cells[(row / kSide) * cols + col / kSide].fit.add((col - cx) / fx, y, 1.0 / cloud.depth_m[i]);
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
  for (int row = 0; row < cloud.height; ++row) {
    for (int col = 0; col < cloud.width; ++col) {
      const std::size_t i = static_cast<std::size_t>(row) * cloud.width + col;
      if (cloud.kind[i] == PixelKind::kNone) continue;
      const int r = row / kSide, c = col / kSide;
      const std::array<int, 5> near{
          r * cols + c, r > 0 ? (r - 1) * cols + c : -1, r + 1 < rows ? (r + 1) * cols + c : -1,
          c > 0 ? r * cols + c - 1 : -1, c + 1 < cols ? r * cols + c + 1 : -1};
      const Eigen::Vector3f p_W = cloud.point_W(i);
      const float tolerance =
          static_cast<float>(config.plane_tolerance_m + 3.0 * noise.sigma(cloud.depth_m[i]));
      float best = tolerance;
      for (const int cell : near) {
        if (cell < 0 || plane_of_cell[cell] == PlaneSegmentation::kNoPlane) continue;
        const Plane& plane = out.planes[plane_of_cell[cell]];
        const float gap = std::abs(plane.normal_W.dot(p_W) - plane.offset_m);
        if (gap < best) {
          best = gap;
          out.plane_of[i] = plane_of_cell[cell];
        }
        if (cell == near[0] && best < tolerance) break;  // its own cell's plane fits
      }
      if (out.plane_of[i] != PlaneSegmentation::kNoPlane) ++out.planes[out.plane_of[i]].pixels;
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

PlaneVotes count_votes(const PlaneSegmentation& planes, const OrganizedCloud& cloud) {
  PlaneVotes result;
  result.counts.resize(planes.planes.size());
  result.voters.resize(planes.planes.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint16_t plane = planes.plane_of[i];
    if (plane == PlaneSegmentation::kNoPlane || !votes(cloud.kind[i])) continue;
    ++result.voters[plane];
    auto& counts = result.counts[plane];
    bool found = false;
    for (ClassCount& c : counts) {
      if (c.label != cloud.label[i]) continue;
      ++c.count;
      found = true;
      break;
    }
    if (!found) counts.push_back({cloud.label[i], cloud.kind[i], 1});
  }
  return result;
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
  }
  const float band = static_cast<float>(config.ground_band_m);
  const float ceiling = static_cast<float>(config.max_height_m);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    PixelKind& kind = cloud.kind[i];
    if (!votes(kind)) continue;
    if (!known_) continue;
    const float height = normal_W_.dot(cloud.point_W(i)) - offset_m_;
    // Noise acts along the ray; what counts is its vertical part.
    const float slope = std::abs(cloud.z_W[i] - camera_z) / cloud.depth_m[i];
    const float spread = band + slope * static_cast<float>(noise.sigma(cloud.depth_m[i]));
    if (height < spread) {
      kind = PixelKind::kGround;
    } else if (kind == PixelKind::kGround || (height > ceiling && kind == PixelKind::kObject)) {
      kind = PixelKind::kBackground;
    }
  }
}

}  // namespace pocd

#include "pocd/map/birdseye.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "birdseye_canvas.hpp"
#include "birdseye_changes.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/image_codec.hpp"

namespace pocd {
namespace {

constexpr float kNothing = -1e9f;
const cv::Scalar kOutline(60, 56, 52);

// Height below which 2 % of the vertices lie; 0 for an empty mesh.
double ground_height(const Mesh& mesh) {
  if (mesh.vertices_W.empty()) return 0.0;
  std::vector<float> heights;
  heights.reserve(mesh.vertices_W.size());
  for (const Eigen::Vector3f& p : mesh.vertices_W) heights.push_back(p.z());
  const auto at = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 50);
  std::nth_element(heights.begin(), at, heights.end());
  return *at;
}

// Area to show: everything drawn, with a margin.
void find_area(const Mesh& mesh, const std::vector<ObjectSnapshot>& objects,
               const std::vector<BirdseyeChange>& changes, double lowest, double highest,
               Eigen::Vector2d& low, Eigen::Vector2d& high) {
  low.setConstant(1e9);
  high.setConstant(-1e9);
  for (const Eigen::Vector3f& p : mesh.vertices_W) {
    if (p.z() < lowest || p.z() > highest) continue;
    low = low.cwiseMin(p.head<2>().cast<double>());
    high = high.cwiseMax(p.head<2>().cast<double>());
  }
  const auto show = [&](const OrientedBox& box) {
    for (const Eigen::Vector2d& corner : floor_corners(box)) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  };
  for (const ObjectSnapshot& object : objects) show(object.box);
  for (const BirdseyeChange& change : changes) {
    if (change.before) show(*change.before);
    if (change.after) show(*change.after);
  }
  if (low.x() > high.x()) low.setConstant(-1.0), high.setConstant(1.0);
  const double margin = std::max(0.03 * (high - low).maxCoeff(), 0.05);
  low.array() -= margin;
  high.array() += margin;
}

// The highest surface over every pixel.
struct TopView {
  cv::Mat1f height;
  cv::Mat1i triangle;
};

void rasterise(const Mesh& mesh, const BirdseyeCanvas& canvas, double lowest, double highest,
               TopView& view) {
  const cv::Rect plot = canvas.plot();
  view.height = cv::Mat1f(plot.size(), kNothing);
  view.triangle = cv::Mat1i(plot.size(), -1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    cv::Point2d p[3];
    double z[3];
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3f& v = mesh.vertices_W[mesh.triangles[t][i]];
      p[i] = canvas.to_pixel(v.x(), v.y()) - cv::Point2d(plot.x, plot.y);
      z[i] = v.z();
    }
    if (std::min({z[0], z[1], z[2]}) < lowest || std::max({z[0], z[1], z[2]}) > highest) continue;
    const double area = (p[1] - p[0]).cross(p[2] - p[0]);
    const int left = std::max(0, cvFloor(std::min({p[0].x, p[1].x, p[2].x})));
    const int right = std::min(plot.width - 1, cvFloor(std::max({p[0].x, p[1].x, p[2].x})));
    const int top = std::max(0, cvFloor(std::min({p[0].y, p[1].y, p[2].y})));
    const int bottom = std::min(plot.height - 1, cvFloor(std::max({p[0].y, p[1].y, p[2].y})));
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        // A wall seen from above has no area: it is drawn one pixel wide, at its highest point.
        double height = std::max({z[0], z[1], z[2]});
        if (std::abs(area) > 0.5) {
          const cv::Point2d q(x + 0.5, y + 0.5);
          const double a = (p[1] - q).cross(p[2] - q) / area, b = (p[2] - q).cross(p[0] - q) / area;
          if (a < -0.01 || b < -0.01 || a + b > 1.01) continue;
          height = a * z[0] + b * z[1] + (1.0 - a - b) * z[2];
        }
        if (height <= view.height(y, x)) continue;
        view.height(y, x) = static_cast<float>(height);
        view.triangle(y, x) = static_cast<int>(t);
      }
    }
  }
}

// Walls are as thin as the grid in this view: what stands higher spreads by one pixel, to be seen.
void thicken(TopView& view) {
  const TopView thin{view.height.clone(), view.triangle.clone()};
  for (int y = 0; y < thin.height.rows; ++y) {
    for (int x = 0; x < thin.height.cols; ++x) {
      for (int v = std::max(0, y - 1); v <= std::min(y + 1, thin.height.rows - 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(x + 1, thin.height.cols - 1); ++u) {
          if (thin.height(v, u) <= view.height(y, x)) continue;
          view.height(y, x) = thin.height(v, u);
          view.triangle(y, x) = thin.triangle(v, u);
        }
      }
    }
  }
}

// Brightness of a triangle in light from the upper left, 0.78 to 1: gives flat greys a relief.
double relief(const Mesh& mesh, int triangle) {
  const auto& t = mesh.triangles[static_cast<std::size_t>(triangle)];
  const Eigen::Vector3f& a = mesh.vertices_W[t[0]];
  const Eigen::Vector3f normal =
      (mesh.vertices_W[t[1]] - a).cross(mesh.vertices_W[t[2]] - a).normalized();
  const Eigen::Vector3f light = Eigen::Vector3f(-0.45f, 0.45f, 0.77f).normalized();
  return 0.78 + 0.22 * std::clamp(static_cast<double>(normal.dot(light)) / 0.85, 0.0, 1.0);
}

void paint(const Mesh& mesh, const std::vector<ObjectSnapshot>& objects, const TopView& view,
           double ground, const BirdseyeOptions& options, BirdseyeCanvas& canvas) {
  std::map<std::uint32_t, double> score;
  for (const ObjectSnapshot& o : objects) score[to_index(o.id)] = o.belief.stationarity();
  cv::Mat plot = canvas.image()(canvas.plot());
  for (int y = 0; y < plot.rows; ++y) {
    for (int x = 0; x < plot.cols; ++x) {
      const int t = view.triangle(y, x);
      if (t < 0) continue;
      const double above = view.height(y, x) - ground;
      // Higher is darker, so that walls stand out from what lies below them.
      const double shade = std::clamp(above / options.highest_m, 0.0, 1.0);
      const auto grey =
          static_cast<std::uint8_t>(above < options.ground_m ? 234 : 205 - 75 * shade);
      cv::Vec3b color(grey, grey, grey);
      const auto known = score.find(mesh.owner[mesh.triangles[static_cast<std::size_t>(t)][0]]);
      if (known != score.end()) {
        const auto c = stationarity_color(known->second);
        for (int i = 0; i < 3; ++i) {
          color[i] = static_cast<std::uint8_t>(c[i] * (0.82 + 0.18 * shade) + 30 * (1.0 - shade));
        }
      }
      plot.at<cv::Vec3b>(y, x) = color * relief(mesh, t);
    }
  }
}

void outline(const std::vector<ObjectSnapshot>& objects, BirdseyeCanvas& canvas) {
  constexpr int kShift = 4;  // fractional bits of the polygon's corners
  for (const ObjectSnapshot& object : objects) {
    std::vector<cv::Point> polygon;
    for (const Eigen::Vector2d& corner : floor_corners(object.box)) {
      const cv::Point2d p = canvas.to_pixel(corner.x(), corner.y()) * (1 << kShift);
      polygon.emplace_back(cvRound(p.x), cvRound(p.y));
    }
    cv::polylines(canvas.image(), polygon, true, kOutline, 1, cv::LINE_AA, kShift);
  }
}

void label(const std::vector<ObjectSnapshot>& objects, BirdseyeCanvas& canvas) {
  for (const ObjectSnapshot& object : objects) {
    const Eigen::Vector3d& center = object.box.pose.position_W;
    canvas.label(std::to_string(to_index(object.id)), canvas.to_pixel(center.x(), center.y()),
                 0.42);
  }
}

}  // namespace

std::array<std::uint8_t, 3> stationarity_color(double score) {
  constexpr double kRamp[3][3] = {{52, 58, 210}, {62, 196, 246}, {84, 158, 46}};  // BGR
  const double s = 2.0 * std::clamp(score, 0.0, 1.0);
  const int part = s < 1.0 ? 0 : 1;
  std::array<std::uint8_t, 3> color;
  for (int i = 0; i < 3; ++i) {
    color[i] = static_cast<std::uint8_t>(
        std::lround(kRamp[part][i] + (s - part) * (kRamp[part + 1][i] - kRamp[part][i])));
  }
  return color;
}

AppearanceOf appearance_by_stationarity(const std::vector<ObjectSnapshot>& objects) {
  std::map<std::uint32_t, OwnerAppearance> known;
  for (const ObjectSnapshot& object : objects) {
    const auto bgr = stationarity_color(object.belief.stationarity());
    known[to_index(object.id)] = {{bgr[2], bgr[1], bgr[0]}, object.class_id};
  }
  return [known](std::uint32_t owner) {
    const auto it = known.find(owner);
    return it == known.end() ? OwnerAppearance{} : it->second;
  };
}

cv::Mat draw_birdseye(const Mesh& mesh, const std::vector<ObjectSnapshot>& objects,
                      const BirdseyeOptions& options) {
  POCD_CHECK(options.size_px >= 400);
  const double ground = ground_height(mesh);
  const double lowest = ground + options.lowest_m, highest = ground + options.highest_m;
  Eigen::Vector2d low, high;
  find_area(mesh, objects, options.changes, lowest, highest, low, high);
  BirdseyeCanvas canvas(low, high, options.size_px);
  canvas.draw_grid();
  TopView view;
  rasterise(mesh, canvas, lowest, highest, view);
  thicken(view);
  // Surfaces over outlines: a line that is left is a side of a box that nobody has seen.
  outline(objects, canvas);
  paint(mesh, objects, view, ground, options, canvas);
  draw_changes(options.changes, canvas);
  label(objects, canvas);
  canvas.decorate(options.title,
                  std::to_string(objects.size()) + (objects.size() == 1 ? " object" : " objects"));
  return canvas.image();
}

void write_birdseye(const Mesh& mesh, const std::vector<ObjectSnapshot>& objects,
                    const std::filesystem::path& file, const BirdseyeOptions& options) {
  if (file.extension() != ".png")
    throw InputError(file.string() + ": pictures are written as .png");
  write_png(file, draw_birdseye(mesh, objects, options));
}

}  // namespace pocd

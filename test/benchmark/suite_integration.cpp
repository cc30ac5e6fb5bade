#include <nanoflann.hpp>

#include "peers.hpp"
#include "pocd/eval/scene_truth.hpp"
#include "pocd/eval/surface_points.hpp"
#include "report.hpp"
#include "statistics.hpp"
#include "suites.hpp"

namespace pocd::bench {
namespace {

struct Run {
  Series one, two, opencv;
  Points surface;
  OrientedPoints opencv_surface;
  std::size_t blocks = 0;
};

Run integrate_all(const FrameSet& set, const TsdfConfig& config, int passes) {
  Run run;
  ThreadPool pool_1(1), pool_2(2);
  std::vector<std::vector<std::uint32_t>> owners;
  for (const Frame& frame : set.frames) owners.push_back(made_up_owners(frame));
  for (int pass = 0; pass < passes; ++pass) {
    TsdfMap map_1(config), map_2(config);
    HashTsdf hash(config);
    for (std::size_t i = 0; i < set.frames.size(); ++i) {
      const Frame& frame = set.frames[i];
      const IntegrationInput input{&frame, owners[i].data(), frame.camera.width / kOwnerStride,
                                   frame.camera.height / kOwnerStride, kOwnerStride};
      for (std::size_t turn = 0; turn < 3; ++turn) {
        switch (in_turn(i, turn)) {
          case 0:
            time_into(run.one, i, [&] { map_1.integrate(input, pool_1); });
            break;
          case 1:
            time_all_into(run.two, i, [&] { map_2.integrate(input, pool_2); });
            break;
          default:
            time_into(run.opencv, i, [&] { hash.integrate(frame); });
        }
      }
    }
    if (pass + 1 < passes) continue;
    run.blocks = map_1.block_count();
    run.surface = surface_points(map_1, config.min_publish_weight);
    run.opencv_surface = hash.surface(set.frames);
  }
  return run;
}

struct PointsAdaptor {
  const Points& points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// Distances along the peer's normals between our surface points and the peer's surface, where it
/// has one within two voxels; both are samples of a surface, not its whole.
std::vector<double> disagreement_mm(const Points& ours, const OrientedPoints& theirs,
                                    double voxel_m) {
  const PointsAdaptor adaptor{theirs.points_W};
  using Tree =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointsAdaptor>,
                                          PointsAdaptor, 3>;
  Tree tree(3, adaptor);
  tree.buildIndex();
  std::vector<double> distances;
  for (const Eigen::Vector3f& p : ours) {
    std::uint32_t nearest = 0;
    float squared = 0.0f;
    if (tree.knnSearch(p.data(), 1, &nearest, &squared) == 0 || squared > 4.0 * voxel_m * voxel_m) {
      continue;
    }
    const Eigen::Vector3f& n = theirs.normals_W[nearest];
    if (!n.allFinite()) continue;
    distances.push_back(1e3 * std::abs(n.dot(p - theirs.points_W[nearest])));
  }
  return distances;
}

/// Distances to the true surfaces of the scene [mm], up to 0.2 m.
std::vector<double> error_mm(const Points& points, const Scene& scene) {
  std::vector<double> errors;
  for (const auto& p : points) {
    errors.push_back(1e3 * surface_distance(scene, p.cast<double>(), 0.2));
  }
  return errors;
}

/// How much faster two threads are than one at arithmetic that shares nothing, in pieces as long as
/// the integration's: what can be had on this machine at this moment.
double possible_speed_up() {
  constexpr std::size_t kPieces = 40;
  constexpr int kTurns = 100;
  ThreadPool pool_1(1), pool_2(2);
  std::vector<float> results(16 * kPieces);  // a cache line each
  const auto piece = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float x = static_cast<float>(i) * 1e-3f;
      for (int k = 0; k < 5000; ++k) x = x * 0.999f + 1e-3f;
      results[16 * i] = x;
    }
  };
  Series one, two;
  for (int turn = 0; turn < kTurns; ++turn) {
    time_into(one, one.wall().size(), [&] { pool_1.parallel_for(kPieces, 1, piece); });
    time_all_into(two, two.wall().size(), [&] { pool_2.parallel_for(kPieces, 1, piece); });
  }
  return median(one.wall()) / median(two.wall());
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

}  // namespace

void run_integration(const FrameSet& set, const SuiteOptions& options, std::ostream& out) {
  Table table("Integration with owners, " + set.name,
              {"voxel", "CPU 1 thread: median, p95, max [ms]", "OpenCV hash TSDF [ms]", "ratio",
               "wall 1 thread [ms]", "wall 2 threads [ms]", "speed-up", "blocks"});
  Table quality("Surfaces, " + set.name,
                {"voxel", "points, ours", "points, OpenCV", "disagreement: median, mean, p95 [mm]",
                 "half a voxel [mm]", "error to truth, ours: median, mean [mm]",
                 "error to truth, OpenCV [mm]"});
  for (const double voxel_m : {0.05, 0.02}) {
    TsdfConfig config = set.config.map;
    config.voxel_size_m = voxel_m;
    const Run run = integrate_all(set, config, options.passes);
    const std::string voxel = number(1e2 * voxel_m, 0) + " cm";
    const auto& cpu = run.one.cpu();
    table.row({voxel,
               number(median(cpu)) + ", " + number(quantile(cpu, 0.95)) + ", " +
                   number(quantile(cpu, 1.0)),
               number(median(run.opencv.cpu())), number(median(cpu) / median(run.opencv.cpu()), 3),
               number(median(run.one.wall())), number(median(run.two.wall())),
               number(median(run.one.wall()) / median(run.two.wall())),
               std::to_string(run.blocks)});
    const auto gap = disagreement_mm(run.surface, run.opencv_surface, voxel_m);
    std::string ours = "-", theirs = "-";
    if (set.scenario) {
      const Scene scene = scene_at(*set.scenario, 0, 0.0);
      const auto a = error_mm(run.surface, scene), b = error_mm(run.opencv_surface.points_W, scene);
      ours = number(median(a), 1) + ", " + number(mean(a), 1);
      theirs = number(median(b), 1) + ", " + number(mean(b), 1);
    }
    quality.row({voxel, std::to_string(run.surface.size()),
                 std::to_string(run.opencv_surface.points_W.size()),
                 number(median(gap), 1) + ", " + number(mean(gap), 1) + ", " +
                     number(quantile(gap, 0.95), 1),
                 number(500.0 * voxel_m, 0), ours, theirs});
  }
  table.note("Arithmetic in registers, handed to two threads in the same way: " +
             number(possible_speed_up()) + " times as fast as with one.");
  table.write(out);
  quality.write(out);
}

}  // namespace pocd::bench

#include <map>

#include "peers.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd/segmentation/observations.hpp"
#include "report.hpp"
#include "statistics.hpp"
#include "suites.hpp"

namespace pocd::bench {
namespace {

/// The slow peers see every so many frames.
constexpr std::size_t kPeerStride = 10;

/// What one pipeline took, whole and by stage.
struct Times {
  Series total;
  std::vector<std::string> order;
  std::map<std::string, Series> stage;
};

struct Peers {
  Series hash_tsdf, pcl_2cm, pcl_5cm, points, normals, planes, components;
};

void process(PocdPipeline& pipeline, int threads, const Frame& frame, std::size_t i, Times& times) {
  FrameResult result;
  const auto work = [&] { result = pipeline.process_frame(frame); };
  if (threads == 1) {
    time_into(times.total, i, work);
  } else {
    time_all_into(times.total, i, work);
  }
  for (const StageTiming& t : result.timings) {
    if (times.stage.find(t.stage) == times.stage.end()) times.order.push_back(t.stage);
    times.stage[t.stage].add(i, t.cpu_ms, t.wall_ms);
  }
}

// A grid coarser than the tolerance would cut everything apart.
double fine_leaf_m(const SegmentationConfig& c) {
  return std::min(0.02, 0.4 * c.cluster_tolerance_m);
}
double coarse_leaf_m(const SegmentationConfig& c) {
  return std::min(0.05, 0.5 * c.cluster_tolerance_m);
}
std::string centimetres(double m) { return number(1e2 * m, m < 0.01 ? 1 : 0) + " cm"; }

/// CPU time of two stages together, by frame.
std::vector<double> both(const Times& times, const char* a, const char* b) {
  std::vector<double> sum = times.stage.at(a).cpu();
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += times.stage.at(b).cpu()[i];
  return sum;
}

void run_peers(const FrameSet& set, const Frame& frame, std::size_t sample, Peers& peers) {
  const SegmentationConfig& segmentation = set.config.segmentation;
  ThreadPool pool(1);
  OrganizedCloud cloud;
  organize(frame, segmentation.stride, set.config.map.max_depth_m, set.config.classes,
           ClassTable(set.config.classes), pool, cloud);
  const PclFrame pcl(cloud);
  const double plane_m = segmentation.plane_tolerance_m;
  const double tolerance_m = segmentation.cluster_tolerance_m;
  time_into(peers.pcl_2cm, sample,
            [&] { pcl.clean_and_cluster(fine_leaf_m(segmentation), plane_m, tolerance_m); });
  time_into(peers.pcl_5cm, sample,
            [&] { pcl.clean_and_cluster(coarse_leaf_m(segmentation), plane_m, tolerance_m); });
  cv::Mat points, normals;
  time_into(peers.points, sample, [&] { points = opencv_points(frame); });
  if (!points.empty()) {
    time_into(peers.normals, sample, [&] { normals = opencv_normals(frame, points); });
    time_into(peers.planes, sample, [&] { opencv_planes(frame, points, normals); });
  }
  time_into(peers.components, sample,
            [&] { opencv_components(frame, set.config.map.max_depth_m, tolerance_m); });
}

/// Values at every kPeerStride-th frame, to compare with a peer that saw only those.
std::vector<double> sampled(const std::vector<double>& values) {
  std::vector<double> some;
  for (std::size_t i = 0; i < values.size(); i += kPeerStride) some.push_back(values[i]);
  return some;
}

void write_stages(const FrameSet& set, const Times& one, const Times& two, std::ostream& out) {
  Table table(
      "process_frame by stage, " + set.name + ", " + std::to_string(set.frames.size()) + " frames",
      {"stage", "CPU 1 thread: median", "p95", "p99", "max [ms]", "wall 1 thread: median", "p95",
       "max [ms]", "wall 2 threads: median", "p95", "max [ms]", "CPU 2 threads: median [ms]",
       "speed-up"});
  const auto row = [&](const std::string& stage, const Series& s1, const Series& s2) {
    std::vector<std::string> cells{stage};
    for (const double share : {0.5, 0.95, 0.99, 1.0}) {
      cells.push_back(number(quantile(s1.cpu(), share)));
    }
    for (const Series* s : {&s1, &s2}) {
      for (const double share : {0.5, 0.95, 1.0}) {
        cells.push_back(number(quantile(s->wall(), share)));
      }
    }
    cells.push_back(number(median(s2.cpu())));
    cells.push_back(number(median(s1.wall()) / median(s2.wall())));
    table.row(std::move(cells));
  };
  for (const std::string& stage : one.order) row(stage, one.stage.at(stage), two.stage.at(stage));
  row("process_frame", one.total, two.total);
  const auto& total = one.total.cpu();
  table.note("CPU p99 is " + number(quantile(total, 0.99) / median(total)) + " times the median.");
  table.write(out);
}

void write_peers(const FrameSet& set, const Times& one, const Peers& peers, std::ostream& out) {
  Table table("Beside its peers, " + set.name + ", CPU of one thread, medians",
              {"what", "ours [ms]", "peer", "peer [ms]", "ours / peer", "peer / ours"});
  const auto compare = [&](const std::string& what, const std::vector<double>& ours,
                           const std::string& peer, const std::vector<double>& theirs) {
    if (theirs.empty()) return;
    table.row({what, number(median(ours)), peer, number(median(theirs)),
               number(median(ours) / median(theirs), 3), number(median(theirs) / median(ours), 1)});
  };
  compare("process_frame", one.total.cpu(), "OpenCV hash TSDF, integration alone",
          peers.hash_tsdf.cpu());
  const auto clean_cluster = sampled(both(one, "clean", "cluster"));
  compare("map (owners, integration)", one.stage.at("map").cpu(), "OpenCV hash TSDF",
          peers.hash_tsdf.cpu());
  const SegmentationConfig& segmentation = set.config.segmentation;
  compare("clean + cluster", clean_cluster,
          "PCL voxel grid " + centimetres(fine_leaf_m(segmentation)) + ", RANSAC, clusters",
          peers.pcl_2cm.cpu());
  compare("clean + cluster", clean_cluster,
          "PCL voxel grid " + centimetres(coarse_leaf_m(segmentation)) + ", RANSAC, clusters",
          peers.pcl_5cm.cpu());
  compare("organize", sampled(one.stage.at("organize").cpu()), "cv::rgbd::depthTo3d (camera frame)",
          peers.points.cpu());
  std::vector<double> planes = peers.planes.cpu();
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i] += peers.normals.cpu()[i];
  compare("clean", sampled(one.stage.at("clean").cpu()), "cv::rgbd normals and planes", planes);
  compare("cluster", sampled(one.stage.at("cluster").cpu()),
          "edge mask, cv::connectedComponents (labels only)", peers.components.cpu());
  table.write(out);
}

/// Which objects of the truth `clean` and `cluster` find, and which PCL with grids as coarse as its
/// times above are for, and of 5 cm with a tolerance that suits it.
void write_found(const FrameSet& set, std::ostream& out) {
  const SegmentationConfig& segmentation = set.config.segmentation;
  const double tolerance_m = segmentation.cluster_tolerance_m;
  struct Chain {
    double leaf_m, tolerance_m;
    FoundObjects found;
  };
  std::vector<Chain> chains{{fine_leaf_m(segmentation), tolerance_m, {}},
                            {coarse_leaf_m(segmentation), tolerance_m, {}}};
  if (tolerance_m < 0.1) chains.push_back({0.05, 0.1, {}});
  FoundObjects ours;
  ThreadPool pool(1);
  const ClassTable classes(set.config.classes);
  OrganizedCloud cloud;
  PlaneSegmentation planes;
  GroundModel ground;
  Observations observations;
  for (std::size_t i = 0; i < set.frames.size(); i += kPeerStride) {
    organize(set.frames[i], segmentation.stride, set.config.map.max_depth_m, set.config.classes,
             classes, pool, cloud);
    const PclFrame pcl(cloud);
    const Clusters truth = true_clusters(cloud, set.objects[i], segmentation);
    const int least = 2 * segmentation.min_cluster_pixels;
    for (Chain& c : chains) {
      c.found.add(truth,
                  pcl.clusters(cloud, c.leaf_m, segmentation.plane_tolerance_m, c.tolerance_m),
                  least);
    }
    segment_planes(cloud, segmentation, set.config.depth_noise, planes);
    vote_planes(planes, segmentation.majority_share, cloud);
    ground.update(planes, segmentation, set.config.depth_noise, cloud);
    extract_observations(segmentation, set.config.depth_noise, set.config.map.voxel_size_m, planes,
                         cloud, observations);
    ours.add(truth, observations.observation_of, least);
  }
  Table table("Objects found by clean + cluster, " + set.name,
              {"how", "objects in sight", "found as one cluster", "share"});
  const auto row = [&](const std::string& how, const FoundObjects& f) {
    table.row({how, std::to_string(f.in_sight), std::to_string(f.found),
               number(static_cast<double>(f.found) / std::max(1, f.in_sight))});
  };
  row("ours", ours);
  for (const Chain& c : chains) {
    row("PCL, grid " + centimetres(c.leaf_m) + ", tolerance " + centimetres(c.tolerance_m),
        c.found);
  }
  table.write(out);
}

}  // namespace

void run_pipeline(const FrameSet& set, const SuiteOptions& options, std::ostream& out) {
  PipelineConfig config_1 = set.config, config_2 = set.config;
  config_1.threads = 1;
  config_2.threads = 2;
  Times one, two;
  Peers peers;
  for (int pass = 0; pass < options.passes; ++pass) {
    PocdPipeline pipeline_1(config_1), pipeline_2(config_2);
    HashTsdf hash(set.config.map);
    for (std::size_t i = 0; i < set.frames.size(); ++i) {
      const Frame& frame = set.frames[i];
      for (std::size_t turn = 0; turn < 3; ++turn) {
        switch (in_turn(i, turn)) {
          case 0:
            process(pipeline_1, 1, frame, i, one);
            break;
          case 1:
            process(pipeline_2, 2, frame, i, two);
            break;
          default:
            if (HashTsdf::available()) {
              time_into(peers.hash_tsdf, i, [&] { hash.integrate(frame); });
            }
        }
      }
      if (i % kPeerStride == 0) run_peers(set, frame, i / kPeerStride, peers);
    }
  }
  write_stages(set, one, two, out);
  write_peers(set, one, peers, out);
  if (!set.objects.empty()) write_found(set, out);
}

}  // namespace pocd::bench

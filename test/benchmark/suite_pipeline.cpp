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

/// What one pipeline took: the whole by both clocks, its stages by the wall clock.
struct Times {
  Series total;
  std::vector<std::string> order;
  std::map<std::string, Series> stage;
};

/// The stages before objects come into play, called by hand: CPU time of each.
struct FrontEnd {
  Series organize, clean, cluster, clean_and_cluster;
};

struct Peers {
  Series hash_tsdf, pcl_2cm, pcl_5cm, points, normals, planes, components;
};

void process(PocdPipeline& pipeline, const Frame& frame, std::size_t i, Times& times) {
  FrameResult result;
  time_into(times.total, i, [&] { result = pipeline.process_frame(frame); });
  for (const StageTiming& t : result.timings) {
    if (times.stage.find(t.stage) == times.stage.end()) times.order.push_back(t.stage);
    times.stage[t.stage].add(i, 0.0, t.wall_ms);
  }
}

class FrontEndRun {
 public:
  explicit FrontEndRun(const PipelineConfig& config) : config_(config), table_(config.classes) {}

  void run(const Frame& frame, std::size_t i, FrontEnd& times) {
    const SegmentationConfig& segmentation = config_.segmentation;
    time_into(times.organize, i, [&] {
      organize(frame, segmentation.stride, config_.map.max_depth_m, config_.classes, table_, pool_,
               cloud_);
    });
    const auto clean = [&] {
      segment_planes(cloud_, segmentation, config_.depth_noise, planes_);
      vote_planes(planes_, segmentation.majority_share, cloud_);
      ground_.update(planes_, segmentation, config_.depth_noise, cloud_);
    };
    const auto cluster = [&] {
      extract_observations(segmentation, config_.depth_noise, config_.map.voxel_size_m, planes_,
                           cloud_, observations_);
    };
    time_into(times.clean_and_cluster, i, [&] {
      time_into(times.clean, i, clean);
      time_into(times.cluster, i, cluster);
    });
  }

 private:
  PipelineConfig config_;
  ClassTable table_;
  ThreadPool pool_{1};
  GroundModel ground_;
  OrganizedCloud cloud_;
  PlaneSegmentation planes_;
  Observations observations_;
};

void run_peers(const FrameSet& set, const Frame& frame, std::size_t sample, Peers& peers) {
  const SegmentationConfig& segmentation = set.config.segmentation;
  ThreadPool pool(1);
  OrganizedCloud cloud;
  organize(frame, segmentation.stride, set.config.map.max_depth_m, set.config.classes,
           ClassTable(set.config.classes), pool, cloud);
  const PclFrame pcl(cloud);
  const double plane_m = segmentation.plane_tolerance_m;
  const double tolerance_m = segmentation.cluster_tolerance_m;
  // A grid coarser than the tolerance would cut everything apart.
  time_into(peers.pcl_2cm, sample, [&] {
    pcl.clean_and_cluster(std::min(0.02, 0.4 * tolerance_m), plane_m, tolerance_m);
  });
  time_into(peers.pcl_5cm, sample, [&] {
    pcl.clean_and_cluster(std::min(0.05, 0.5 * tolerance_m), plane_m, tolerance_m);
  });
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

void write_stages(const FrameSet& set, const Times& one, const Times& two, const FrontEnd& front,
                  std::ostream& out) {
  Table table(
      "process_frame by stage, " + set.name + ", " + std::to_string(set.frames.size()) + " frames",
      {"stage", "CPU 1 thread: median", "p95", "p99", "max [ms]", "wall 1 thread: median", "p95",
       "max [ms]", "wall 2 threads: median", "p95", "max [ms]"});
  const auto row = [&](const std::string& stage, const std::vector<double>* cpu,
                       const std::vector<double>& wall_1, const std::vector<double>& wall_2) {
    std::vector<std::string> cells{stage};
    for (const double share : {0.5, 0.95, 0.99, 1.0}) {
      cells.push_back(cpu ? number(quantile(*cpu, share)) : "");
    }
    for (const auto* wall : {&wall_1, &wall_2}) {
      for (const double share : {0.5, 0.95, 1.0}) cells.push_back(number(quantile(*wall, share)));
    }
    table.row(std::move(cells));
  };
  const std::map<std::string, const std::vector<double>*> by_hand{
      {"organize", &front.organize.cpu()},
      {"clean", &front.clean.cpu()},
      {"cluster", &front.cluster.cpu()}};
  for (const std::string& stage : one.order) {
    const auto cpu = by_hand.find(stage);
    row(stage, cpu == by_hand.end() ? nullptr : cpu->second, one.stage.at(stage).wall(),
        two.stage.at(stage).wall());
  }
  row("process_frame", &one.total.cpu(), one.total.wall(), two.total.wall());
  const auto& total = one.total.cpu();
  table.note("CPU p99 is " + number(quantile(total, 0.99) / median(total)) +
             " times the median; with 2 threads the CPU median is " +
             number(median(two.total.cpu())) + " ms. The first three stages were timed by hand.");
  table.write(out);
}

void write_peers(const FrameSet& set, const Times& one, const FrontEnd& front, const Peers& peers,
                 std::ostream& out) {
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
  const auto clean_cluster = sampled(front.clean_and_cluster.cpu());
  compare("clean + cluster", clean_cluster, "PCL voxel grid 2 cm, RANSAC, clusters",
          peers.pcl_2cm.cpu());
  compare("clean + cluster", clean_cluster, "PCL voxel grid 5 cm, RANSAC, clusters",
          peers.pcl_5cm.cpu());
  compare("organize", sampled(front.organize.cpu()), "cv::rgbd::depthTo3d (camera frame)",
          peers.points.cpu());
  std::vector<double> planes = peers.planes.cpu();
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i] += peers.normals.cpu()[i];
  compare("clean", sampled(front.clean.cpu()), "cv::rgbd normals and planes", planes);
  compare("cluster", sampled(front.cluster.cpu()),
          "edge mask, cv::connectedComponents (labels only)", peers.components.cpu());
  if (set.config.segmentation.cluster_tolerance_m < 0.1) {
    table.note("PCL's grids are finer here, to fit the smaller cluster tolerance.");
  }
  table.write(out);
}

}  // namespace

void run_pipeline(const FrameSet& set, const SuiteOptions& options, std::ostream& out) {
  PipelineConfig config_1 = set.config, config_2 = set.config;
  config_1.threads = 1;
  config_2.threads = 2;
  Times one, two;
  FrontEnd front;
  Peers peers;
  for (int pass = 0; pass < options.passes; ++pass) {
    PocdPipeline pipeline_1(config_1), pipeline_2(config_2);
    HashTsdf hash(set.config.map);
    FrontEndRun front_run(set.config);
    for (std::size_t i = 0; i < set.frames.size(); ++i) {
      const Frame& frame = set.frames[i];
      for (std::size_t turn = 0; turn < 4; ++turn) {  // nobody is always the first
        switch ((i + turn) % 4) {
          case 0:
            process(pipeline_1, frame, i, one);
            break;
          case 1:
            process(pipeline_2, frame, i, two);
            break;
          case 2:
            front_run.run(frame, i, front);
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
  write_stages(set, one, two, front, out);
  write_peers(set, one, front, peers, out);
}

}  // namespace pocd::bench

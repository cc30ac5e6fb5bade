// pocd_scale: what a frame costs in a small map and in a large one, in turns, and what a square
// metre of map takes.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "heap_counter.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/cpu_time.hpp"
#include "pocd/map/map_io.hpp"
#include "pocd/map/mesh.hpp"
#include "scale_halls.hpp"

namespace pocd::benchmark {
namespace {

constexpr double kMegabyte = 1024.0 * 1024.0;

double quantile(std::vector<double> values, double q) {
  const auto at = values.begin() +
                  static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double median(const std::vector<double>& values) { return quantile(values, 0.5); }

/// What the frames of one site took.
struct Cost {
  std::string name;
  std::vector<double> frame_ms, publish_ms, heap_calls, heap_kb;
  std::uint64_t visits = 0;
};

std::uint64_t visits(const Site& site) {
  const MapVisits map = site.pipeline().map().visits();
  return map.regions + map.blocks + site.pipeline().object_visits();
}

void measure(Site& site, const Frame& frame, Cost& cost) {
  const std::uint64_t visited = visits(site);
  const HeapCount heap = heap_count();
  const double start = thread_cpu_ms();
  site.process(frame);
  const double between = thread_cpu_ms();
  site.publish();
  const double end = thread_cpu_ms();
  cost.frame_ms.push_back(between - start);
  cost.publish_ms.push_back(end - between);
  cost.heap_calls.push_back(static_cast<double>(heap_count().calls - heap.calls));
  cost.heap_kb.push_back(static_cast<double>(heap_count().bytes - heap.bytes) / 1024.0);
  cost.visits += visits(site) - visited;
}

void print_costs(const std::vector<Cost>& costs, std::size_t frames) {
  std::printf(
      "\nPer frame in the first hall (CPU time, one thread; medians over %zu frames in turns;\n"
      "ratio to the first line, median over the frames of the ratio of the same frame):\n\n"
      "| map | frame [ms] | p99 [ms] | ratio | publish [ms] | ratio | heap calls | ratio | heap "
      "[KB] "
      "| ratio | visited | ratio |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n",
      frames);
  const Cost& base = costs.front();
  const auto ratio = [](const std::vector<double>& mine, const std::vector<double>& theirs) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < mine.size(); ++i) {
      if (theirs[i] > 0.0) ratios.push_back(mine[i] / theirs[i]);
    }
    return ratios.empty() ? 1.0 : median(ratios);
  };
  for (const Cost& c : costs) {
    std::printf(
        "| %s | %.2f | %.2f | %.2f | %.2f | %.2f | %.0f | %.2f | %.0f | %.2f | %.0f | %.2f |\n",
        c.name.c_str(), median(c.frame_ms), quantile(c.frame_ms, 0.99),
        ratio(c.frame_ms, base.frame_ms), median(c.publish_ms),
        ratio(c.publish_ms, base.publish_ms), median(c.heap_calls),
        ratio(c.heap_calls, base.heap_calls), median(c.heap_kb), ratio(c.heap_kb, base.heap_kb),
        static_cast<double>(c.visits) / static_cast<double>(frames),
        static_cast<double>(c.visits) / static_cast<double>(base.visits));
  }
}

double area_of(const Mesh& mesh) {
  double area = 0.0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices_W[t[0]];
    area += 0.5 * (mesh.vertices_W[t[1]] - a).cross(mesh.vertices_W[t[2]] - a).norm();
  }
  return area;
}

std::uint64_t published_bytes(const MapPublisher& publisher) {
  std::uint64_t bytes = 0;
  for (const auto& entry : publisher.tiles()) bytes += entry.second.payload.size();
  return bytes;
}

void print_memory(const Site& site, const std::string& name, double surface_m2) {
  const MapMemoryStatus map = site.pipeline().map().memory_status();
  const std::size_t objects = site.pipeline().objects().size();
  const double voxels = static_cast<double>(map.memory_bytes);
  const double rest = static_cast<double>(site.pipeline_heap()) - voxels;
  std::printf("| %s | %zu | %.0f | %.1f | %llu | %.1f | %.1f | %.1f | %.1f | %.1f |\n",
              name.c_str(), objects, surface_m2,
              static_cast<double>(map.blocks_in_memory + map.blocks_on_disk) / 1000.0,
              static_cast<unsigned long long>(map.evictions), voxels / kMegabyte,
              static_cast<double>(map.disk_bytes) / kMegabyte, rest / kMegabyte,
              static_cast<double>(site.publisher_heap()) / kMegabyte,
              static_cast<double>(published_bytes(site.publisher())) / kMegabyte);
}

/// Bytes per square metre of mapped surface, of one hall.
void print_bytes_per_area(const Site& site, double surface_m2) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("pocd_scale_" + std::to_string(::getpid()) + ".map");
  save_map(site.pipeline().map(), file);
  const auto saved = static_cast<double>(std::filesystem::file_size(file));
  std::filesystem::remove(file);
  const double halls = site.halls();
  const auto line = [&](const char* what, double bytes) {
    std::printf("| %s | %.0f | %.0f |\n", what, bytes / surface_m2 / halls,
                bytes / kHallArea_m2 / halls);
  };
  const PipelineConfig config = scale_config();
  std::printf(
      "\nOne hall: %.1f m2 of floor, %.1f m2 of mapped surface (area of its mesh), voxels of %.2f "
      "m.\n\n"
      "| | bytes per m2 of surface | bytes per m2 of floor |\n|---|---:|---:|\n",
      kHallArea_m2, surface_m2, config.map.voxel_size_m);
  const auto memory = site.pipeline().map().memory_status();
  line("voxels and their index in memory", static_cast<double>(memory.memory_bytes));
  line("map file (save_map) on disk", saved);
  line("published tiles, payload", static_cast<double>(published_bytes(site.publisher())));
  line("published tiles, in memory", static_cast<double>(site.publisher_heap()));
}

void run(const std::vector<double>& areas_m2, int budget_mb, double budget_area_m2, int rounds,
         const std::string& folder) {
  const std::vector<Frame> build = drive_through_hall(0.8, 5);
  const std::vector<Frame> drive = drive_through_hall(0.4, 6);
  const PipelineConfig config = scale_config();
  std::vector<Site> sites;
  std::vector<Cost> costs;
  const auto add = [&](const PipelineConfig& c, double area_m2, const std::string& what) {
    const int halls = std::max(1, static_cast<int>(std::lround(area_m2 / kHallArea_m2)));
    char name[80];
    std::snprintf(name, sizeof name, "%.0f m2%s", halls * kHallArea_m2, what.c_str());
    const double start = thread_cpu_ms();
    sites.emplace_back(c, halls, build);
    costs.emplace_back();
    costs.back().name = name;
    std::fprintf(stderr, "%s: %d halls mapped in %.0f s of CPU time\n", name, halls,
                 1e-3 * (thread_cpu_ms() - start));
  };
  for (const double area_m2 : areas_m2) add(config, area_m2, "");
  if (budget_mb > 0) {
    PipelineConfig limited = config;
    limited.map.memory.limit = MapLimit::kBudget;
    limited.map.memory.budget_mb = budget_mb;
    limited.map.memory.folder = folder;
    add(limited, budget_area_m2, ", budget " + std::to_string(budget_mb) + " MiB");
  }

  ThreadPool pool(1);
  const Site hall(config, 1, build);
  const double surface_m2 = area_of(extract_mesh(hall.pipeline().map(), 1, pool));
  print_bytes_per_area(hall, surface_m2);
  std::printf(
      "\nMemory after mapping [MiB]. \"Objects and rest\" is the pipeline's heap without "
      "voxels.\n\n"
      "| map | objects | surface [m2] | blocks [1000] | evictions | voxels | on disk | objects and "
      "rest | published | of that payload |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  for (std::size_t i = 0; i < sites.size(); ++i) {
    print_memory(sites[i], costs[i].name, surface_m2 * sites[i].halls());
  }

  // Twice apart: the place is known again, and what was evicted is back.
  std::vector<Cost> returning(costs);
  for (int round = -2; round < rounds; ++round) {
    for (const Frame& frame : drive) {
      for (std::size_t i = 0; i < sites.size(); ++i) {
        Cost unused;
        measure(sites[i], frame, round >= 0 ? costs[i] : round == -2 ? returning[i] : unused);
      }
    }
  }
  print_costs(costs, drive.size() * static_cast<std::size_t>(rounds));
  std::printf("\nThe first drive, when evicted regions come back from disk:\n");
  print_costs(returning, drive.size());
}

}  // namespace
}  // namespace pocd::benchmark

int main(int argc, char** argv) {
  CLI::App app(
      "Maps sites of different sizes, drives through the same hall of each in turns, and prints "
      "what a frame and a square metre cost.\n"
      "Example: pocd_scale --areas 100,1000,10000\n"
      "The default needs about 11 GB of memory.\nExit code: 0 done, 1 failed, 2 usage.",
      "pocd_scale");
  std::vector<double> areas{100, 1000, 10000, 100000};
  int budget_mb = 256, rounds = 5;
  double budget_area_m2 = 100000;
  std::string folder = "/var/tmp";
  app.add_option("--areas", areas, "Sizes of the sites [m2 of floor]; ten objects per 102.4 m2")
      ->delimiter(',')
      ->check(CLI::Range(1.0, 1e7));
  app.add_option("--budget-mb", budget_mb, "One more site, with this memory budget [MiB]; 0: none")
      ->check(CLI::Range(0, 1000000));
  app.add_option("--budget-area", budget_area_m2, "Its size [m2 of floor]")
      ->check(CLI::Range(1.0, 1e7));
  app.add_option("--folder", folder, "Folder for what its budget evicts");
  app.add_option("--rounds", rounds, "Measured drives through the hall")
      ->check(CLI::Range(1, 1000));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    pocd::benchmark::run(areas, budget_mb, budget_area_m2, rounds, folder);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "pocd_scale: " << error.what() << '\n';
    return 1;
  }
}

// What a memory holds, whether it is whole, copies of it.
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>

#include "pocd/common/check.hpp"
#include "pocd/memory/history.hpp"
#include "pocd/output/result_csv.hpp"

namespace {

void show_info(const std::filesystem::path& folder) {
  const pocd::MemoryInfo info = pocd::MemoryReader(folder).info();
  std::printf("lineage: %016" PRIx64 "\n", info.lineage);
  std::printf("file_version: %d\n", info.file_version);
  std::printf("voxel_size_m: %g\ntruncation_voxels: %g\nmin_publish_weight: %d\n",
              info.voxel_size_m, info.truncation_voxels, info.min_publish_weight);
  std::printf("steps: %" PRIu64 "\nended_clean: %s\nlast_stamp_ns: %" PRId64 "\n", info.steps,
              info.ended_clean ? "true" : "false", info.stamp_ns);
  std::printf("map_version: %" PRIu64 "\nmap_digest: %s\n", info.map_version,
              info.digest.hex().c_str());
  std::printf("objects: %" PRIu64 "\nfree_blocks: %" PRIu64 "\ntiles: %" PRIu64
              "\nvoxel_tiles: %" PRIu64 "\n",
              info.objects, info.free_blocks, info.tiles, info.voxel_tiles);
  std::printf("events: %" PRIu64 "\nfirst_event: %" PRIu64 "\nlast_event: %" PRIu64
              "\nevent_bytes: %" PRIu64 "\nfile_bytes: %" PRIu64 "\nruns:\n",
              info.events, info.first_event, info.last_event, info.event_bytes, info.file_bytes);
  for (const pocd::LoggedRun& run : info.runs) {
    std::printf("  - {run: %" PRId64 ", epoch: %016" PRIx64
                ", program: \"%s\", started_ns: %" PRId64 ", first_event: %" PRIu64
                ", ended: %s}\n",
                run.run, run.epoch, run.program.c_str(), run.started_ns, run.first_event,
                run.ended ? "true" : "false");
  }
}

int verify(const std::filesystem::path& folder) {
  const auto wrong = pocd::MemoryReader(folder).verify();
  for (const std::string& line : wrong) std::cout << line << '\n';
  if (wrong.empty()) std::cout << "whole\n";
  return wrong.empty() ? 0 : 1;
}

/// When each region of the map was last looked at.
void export_looks(pocd::MemoryReader& log, const std::filesystem::path& file) {
  const double side_m =
      log.info().voxel_size_m * (pocd::VoxelBlock::kSide << pocd::BlockKey::kRegionShift);
  std::ofstream out(file);
  out << "low_x,low_y,low_z,side,last_looked_ns\n";
  for (const auto& [region, stamp_ns] : log.last_looks()) {
    out << region.x * side_m << ',' << region.y * side_m << ',' << region.z * side_m << ','
        << side_m << ',' << stamp_ns << '\n';
  }
  out.close();
  if (!out) throw pocd::InputError(file.string() + ": cannot be written in full");
}

void export_all(const std::filesystem::path& folder, const std::filesystem::path& output) {
  std::filesystem::create_directories(output);
  pocd::MemoryReader log(folder);
  log.export_map(output / "map.pocdmap");
  const auto names = log.class_names();
  pocd::EventsCsv events(output / "events.csv");
  pocd::EventsCsv standing(output / "standing.csv");
  const auto name_of = [&](pocd::ClassId id) {
    const auto name = names.find(id);
    return name == names.end() ? "class_" + std::to_string(id) : name->second;
  };
  std::uint64_t after = 0;
  constexpr std::size_t kPage = 1000;
  for (std::size_t got = kPage; got == kPage;) {
    const auto page = log.events(after, kPage);
    for (const pocd::LoggedEvent& logged : page) {
      events.add(logged.event, name_of(logged.event.class_id));
      after = logged.event.sequence;
    }
    got = page.size();
  }
  pocd::History history(log);
  for (const auto& entry : history.state_at(std::numeric_limits<pocd::StampNs>::max())) {
    standing.add(entry.second.event, name_of(entry.second.event.class_id));
  }
  events.close();
  standing.close();
  export_looks(log, output / "regions.csv");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Looks after the memory of a node. info, verify, export and backup may run while the node "
      "does.\n"
      "Example: pocd_memory backup /var/lib/pocd --output /backup/pocd-today\n"
      "Exit code: 0 done, 1 the memory is damaged or cannot be read, 2 usage.",
      "pocd_memory");
  std::filesystem::path folder, output;
  app.set_version_flag("--version", POCD_VERSION);
  app.require_subcommand(1);
  const auto add = [&](const char* name, const char* text) {
    CLI::App* sub = app.add_subcommand(name, text);
    sub->add_option("folder", folder, "Folder of the memory")->required();
    return sub;
  };
  add("info", "What it holds, as YAML");
  add("verify", "Reads everything; one line for each thing that is wrong");
  add("export",
      "Map file, all events, the last event of everything that stands, and when each region was\n"
      "last looked at (CSV)")
      ->add_option("--output", output, "Folder for the files, made if missing")
      ->required();
  add("compact", "Gives room that is not used any more back to the disk; not while a node runs");
  add("backup", "Writes the last step as a memory of its own")
      ->add_option("--output", output, "Folder of the copy, made if missing")
      ->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    if (app.got_subcommand("info")) show_info(folder);
    if (app.got_subcommand("verify")) return verify(folder);
    if (app.got_subcommand("export")) export_all(folder, output);
    if (app.got_subcommand("compact")) pocd::compact_memory(folder);
    if (app.got_subcommand("backup")) pocd::MemoryReader(folder).backup(output);
    return std::fflush(stdout) == 0 && std::cout.flush() ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << "pocd_memory: " << error.what() << '\n';
    return 1;
  }
}

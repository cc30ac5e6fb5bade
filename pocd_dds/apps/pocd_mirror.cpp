// Follows the published map into a copy and writes it to files.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>

#include "apps/common.hpp"
#include "apps/heap_return.hpp"
#include "pocd/map/birdseye.hpp"
#include "pocd/map/mesh.hpp"
#include "pocd/output/result_csv.hpp"
#include "pocd_dds/map_mirror.hpp"

namespace {

struct Options {
  pocd::MirrorOptions mirror;
  std::filesystem::path output;
  bool until_end = false;
  bool until_in_step = false;
  std::optional<std::uint64_t> expect_version;
  std::optional<double> timeout_s;
  std::optional<double> changes_since_s;  ///< data time
};

std::string describe(const pocd::MirrorStatus& status) {
  if (!status.in_step) return "stale, because " + status.stale_because;
  return status.final_version ? "in step with publisher, which has ended its run"
                              : "in step with publisher";
}

void print(const pocd::MirrorStatus& status) {
  std::printf("%s: epoch %016llx version %llu digest %s, %zu tiles, %zu objects\n",
              describe(status).c_str(), static_cast<unsigned long long>(status.epoch),
              static_cast<unsigned long long>(status.version), status.digest.hex().c_str(),
              status.tiles, status.objects);
  std::fflush(stdout);
}

/// The publisher has ended its run, or is not there any more.
bool ended(const pocd::MirrorStatus& status) {
  return status.final_version || (status.publisher_seen && !status.publisher_present);
}

bool reached(const Options& options, const pocd::MirrorStatus& status) {
  if (options.until_end && ended(status)) return true;
  if (options.expect_version && status.in_step && status.version >= *options.expect_version) {
    return true;
  }
  return options.until_in_step && status.in_step && status.version > 0;
}

/// As pocd_memory export writes it, and whether the publisher's run has looked.
void write_regions(const pocd::MirrorContents& contents, const std::filesystem::path& file) {
  const double side_m =
      contents.voxel_size_m * (pocd::VoxelBlock::kSide << pocd::BlockKey::kRegionShift);
  std::ofstream out(file);
  out << "low_x,low_y,low_z,side,last_looked_ns,looked_in_run\n";
  for (const pocd::MirrorRegion& region : contents.regions) {
    out << region.region.x * side_m << ',' << region.region.y * side_m << ','
        << region.region.z * side_m << ',' << side_m << ',' << region.last_looked_ns << ','
        << region.looked_in_run << '\n';
  }
  if (!out.flush()) throw pocd::InputError(file.string() + ": cannot be written");
}

void write_files(const pocd::MirrorContents& contents, const std::filesystem::path& folder,
                 std::vector<pocd::BirdseyeChange> changes) {
  std::filesystem::create_directories(folder);
  const pocd::Mesh mesh =
      pocd::extract_mesh(contents.tiles, contents.voxel_size_m, contents.truncation_m);
  pocd::write_ply(mesh, pocd::appearance_by_stationarity(contents.objects), folder / "map.ply");
  if (!mesh.vertices_W.empty()) {
    pocd::BirdseyeOptions picture;
    picture.changes = std::move(changes);
    pocd::write_birdseye(mesh, contents.objects, folder / "birdseye.png", picture);
  }
  pocd::write_objects_csv(
      contents.objects, [&](pocd::ClassId id) { return contents.class_names.at(id); },
      folder / "objects.csv");
  if (!contents.regions.empty()) write_regions(contents, folder / "regions.csv");
}

int follow(Options options) {
  using std::chrono::milliseconds;
  std::optional<pocd::EventsCsv> events;
  std::vector<pocd::ObjectEvent> heard;
  if (!options.output.empty()) {
    std::filesystem::create_directories(options.output);
    events.emplace(options.output / "events.csv");
    options.mirror.on_event = [&](const pocd::ObjectEvent& event, const std::string& name) {
      events->add(event, name);
      if (options.changes_since_s) heard.push_back(event);
    };
    options.mirror.looks = true;
    options.mirror.callbacks.when_full = pocd::WhenFull::kWait;  // the file has every event
  }
  auto mirror = std::make_unique<pocd::MapMirror>(options.mirror);
  const auto start = std::chrono::steady_clock::now();
  const auto over = [&] {
    return options.timeout_s &&
           std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() >
               *options.timeout_s;
  };
  const auto arrived = [&](const pocd::MirrorStatus& status) { return reached(options, status); };
  std::string last;
  bool done = false;
  pocd::dds::HeapReturn heap;
  while (!done && !pocd::dds::stop_requested && !over()) {
    heap.turn();
    done = mirror->wait_until(arrived, milliseconds(200));
    const pocd::MirrorStatus status = mirror->status();
    const std::string text = describe(status);
    if (text != last) spdlog::info("{} (version {})", text, status.version);
    last = text;
  }
  const pocd::MirrorContents contents = mirror->contents();
  mirror.reset();  // no event comes after this
  if (events) events->close();
  print(contents.status);
  if (!options.output.empty() && contents.status.epoch != 0) {
    const double since_s = options.changes_since_s.value_or(0.0);
    for (const pocd::ObjectSnapshot& object : contents.objects) {  // boxes as they are known by now
      pocd::ObjectEvent known;
      known.kind = pocd::EventKind::kUpdated;
      known.stamp_ns = std::numeric_limits<pocd::StampNs>::max();
      known.object = object.id;
      known.box = object.box;
      heard.push_back(known);
    }
    write_files(contents, options.output,
                pocd::changes_since(heard, static_cast<pocd::StampNs>(1e9 * since_s)));
  }
  if (over() && !done) {
    spdlog::error("gave up after {} s", *options.timeout_s);
    return 1;
  }
  return contents.status.in_step ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Keeps a copy of the published map and says whether it is the publisher's.\n"
      "Example: pocd_mirror --until-end --output output/mirror\n"
      "Exit code: 0 in step with the publisher at the end, 1 stale, 2 usage.",
      "pocd_mirror");
  Options options;
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("--output", options.output,
                 "Folder for events.csv, and at the end map.ply, birdseye.png, objects.csv, and\n"
                 "regions.csv of a publisher with a memory");
  app.add_option("--changes-since", options.changes_since_s,
                 "Draw into birdseye.png what was added, moved or removed from this stamp on [s]")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("--until-end", options.until_end,
               "End when the publisher has ended its run or has gone");
  app.add_flag("--until-in-step", options.until_in_step,
               "End as soon as the copy equals a map that is not empty");
  app.add_option("--expect-version", options.expect_version,
                 "End when the copy equals this version of the map or a later one");
  app.add_option("--timeout", options.timeout_s, "Give up after that many seconds")
      ->check(CLI::PositiveNumber);
  const std::map<std::string, pocd::CatchUp> means{{"either", pocd::CatchUp::kEither},
                                                   {"tiles", pocd::CatchUp::kTiles},
                                                   {"snapshot", pocd::CatchUp::kSnapshot}};
  app.add_option("--catch-up", options.mirror.catch_up,
                 "How to get what was missed: from the tiles kept for late joiners, or by asking")
      ->transform(CLI::CheckedTransformer(means))
      ->option_text("either, tiles or snapshot; default: either");
  app.add_option("--map-id", options.mirror.map_id, "Which map: node.map_id of its publisher")
      ->capture_default_str();
  int domain = -1;
  pocd::dds::add_bus_options(app, domain, options.mirror.profiles_file,
                             options.mirror.security_folder);
  try {
    app.parse(argc, argv);
    options.mirror.domain = domain >= 0 ? domain : pocd::dds::default_domain();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_mirror: " << error.what() << '\n';
    return 2;
  }
  return pocd::dds::guarded("pocd_mirror", [&] {
    pocd::dds::log_to_stderr("pocd_mirror");
    pocd::dds::stop_on_signals();
    return follow(options);
  });
}

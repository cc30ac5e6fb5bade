#include "frame_set.hpp"

#include <cstdlib>
#include <filesystem>

#include "pocd/config/config_io.hpp"
#include "pocd/datasets/open_dataset.hpp"
#include "pocd/eval/state_truth.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"
#include "pocd/sim/truth.hpp"

namespace pocd::bench {
namespace {

const std::filesystem::path kSource = POCD_SOURCE_DIR;

void read_all(DatasetReader& reader, std::size_t limit, FrameSet& set) {
  while (set.frames.size() < limit) {
    auto frame = reader.next();
    if (!frame) break;
    frame->color.release();  // the pipeline does not look at it
    set.frames.push_back(std::move(*frame));
  }
}

FrameSet with_config(const std::string& name, const std::string& file) {
  FrameSet set;
  set.name = name;
  load_config(set.config, {kSource / "config" / file});
  return set;
}

bool is_missing(const std::filesystem::path& folder, FrameSet& set) {
  if (std::filesystem::exists(folder)) return false;
  set.missing = "no " + folder.string() + " (POCD_TEST_DATA names the folder of the recordings)";
  return true;
}

FrameSet simulated(const std::string& name, const std::optional<SensorModel>& sensor,
                   std::size_t limit) {
  FrameSet set = with_config(name, "simulated.yaml");
  set.scenario = load_scenario(kSource / "config/sim/torwic/0.yaml");
  if (sensor) set.scenario->sensor = *sensor;
  SimReaderOptions options;
  options.with_color = false;
  options.threads = 2;
  SimReader reader(*set.scenario, options);
  read_all(reader, limit, set);
  std::vector<OrientedBox> boxes;
  for (const TruthObject& object : objects_after(*set.scenario, 0)) boxes.push_back(object.box);
  set.objects.assign(set.frames.size(), boxes);
  return set;
}

}  // namespace

std::string data_folder() {
  const char* set = std::getenv("POCD_TEST_DATA");
  return set ? set : POCD_TEST_DATA;
}

FrameSet load_redkitchen(std::size_t limit) {
  FrameSet set = with_config("redkitchen", "redkitchen.yaml");
  DatasetOptions options;
  options.format = DatasetFormat::kRgbd;
  options.inputs = {data_folder() + "/redkitchen"};
  if (is_missing(options.inputs.front(), set)) return set;
  options.gravity_W = Eigen::Vector3d(-0.00887, 0.90443, 0.42654).normalized();
  read_all(*open_dataset(options), limit, set);
  return set;
}

FrameSet load_tabletop(std::size_t limit) {
  FrameSet set = with_config("tabletop_states", "tabletop.yaml");
  StateTruth truth;
  load_config(truth, {kSource / "test/data/tabletop_truth.yaml"});
  const std::filesystem::path folder = data_folder() + "/tabletop_states";
  if (is_missing(folder, set)) return set;
  read_all(*open_dataset(state_dataset(truth, folder)), limit, set);
  const auto repeat = static_cast<std::size_t>(truth.frames_per_state);
  for (const ExpectedState& state : expected_states(truth, folder)) {
    std::vector<OrientedBox> boxes;
    for (const ExpectedObject& object : state.objects) boxes.push_back(object.box);
    set.objects.insert(set.objects.end(), repeat, boxes);
  }
  return set;
}

FrameSet load_circuit(std::size_t limit) { return simulated("circuit", std::nullopt, limit); }

FrameSet load_exact_circuit(std::size_t limit) {
  return simulated("exact_circuit", SensorModel::perfect(), limit);
}

std::vector<std::uint32_t> made_up_owners(const Frame& frame) {
  std::vector<std::uint32_t> owners;
  for (int v = 0; v + kOwnerStride <= frame.camera.height; v += kOwnerStride) {
    for (int u = 0; u + kOwnerStride <= frame.camera.width; u += kOwnerStride) {
      const double z = frame.depth_m.at<float>(v, u);
      const Eigen::Vector3d cell =
          (frame.T_W_C * frame.camera.back_project(u, v, z) / 0.5).array().floor();
      const int id = static_cast<int>(cell.x() + 40 * (cell.y() + 40 * cell.z()) + 80000);
      owners.push_back(id % 3 == 0 ? static_cast<std::uint32_t>(id) : 0u);
    }
  }
  return owners;
}

}  // namespace pocd::bench

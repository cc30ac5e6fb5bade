#include <cmath>

#include "../common/parameter_text.hpp"
#include "../sim/yaml_fields.hpp"
#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

/// camera.yaml beside the PCD files of a folder:
///   camera: {width: 640, height: 480, fx: 525, fy: 525, cx: 319.5, cy: 239.5}
///   T_W_C: {translation: [x, y, z], quaternion_xyzw: [x, y, z, w]}   # camera optical frame in the
///   map
/// Either may be left to the options.
void read_camera_file(const fs::path& file, DatasetOptions& options) {
  YamlFields top(load_yaml_file(file), file.string());
  if (top.has("camera")) {
    YamlFields camera(top.node("camera"), file.string() + ": camera");
    options.camera =
        CameraModel{camera.integer("width"), camera.integer("height"), camera.number("fx"),
                    camera.number("fy"),     camera.number("cx"),      camera.number("cy")};
    camera.finish();
    validate(*options.camera, file.string());
  }
  if (top.has("T_W_C")) {
    YamlFields pose(top.node("T_W_C"), file.string() + ": T_W_C");
    const Eigen::VectorXd q = pose.numbers("quaternion_xyzw", 4);
    if (std::abs(q.norm() - 1.0) > 1e-2) pose.fail("quaternion_xyzw", "must have length 1");
    Pose T_W_C = Pose::Identity();
    T_W_C.translation() = pose.numbers("translation", 3);
    T_W_C.linear() = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
    options.T_W_C = T_W_C;
    pose.finish();
  }
  top.finish();
}

std::unique_ptr<DatasetReader> open_pcd_with_camera_file(DatasetOptions options) {
  bool found = false;
  for (const fs::path& folder : options.inputs) {
    const fs::path file = folder / "camera.yaml";
    if (!fs::exists(file)) continue;
    if (found) throw InputError(file.string() + ": only one input may bring a camera.yaml");
    read_camera_file(file, options);
    found = true;
  }
  return open_pcd(options);
}

std::unique_ptr<DatasetReader> open_sim(const DatasetOptions& options) {
  Scenario scenario = load_run(options.inputs);
  if (options.sensor) scenario.sensor = SensorModel::of(*options.sensor);
  SimReaderOptions reader;
  reader.seed = options.seed;
  reader.label_divisor = options.label_divisor;
  reader.with_color = options.with_color;
  return std::make_unique<SimReader>(std::move(scenario), reader);
}

}  // namespace

std::unique_ptr<DatasetReader> open_dataset(const DatasetOptions& options) {
  if (options.inputs.empty()) throw InputError("dataset: no input given");
  if (!(options.frame_rate_hz > 0.0 && options.frame_rate_hz <= 1000.0)) {
    throw InputError("dataset: frame_rate_hz = " + std::to_string(options.frame_rate_hz) +
                     ", not in (0, 1000]");
  }
  switch (options.format) {
    case DatasetFormat::kTorwic:
      return open_torwic(options);
    case DatasetFormat::kToycar:
      return open_toycar(options);
    case DatasetFormat::kRgbd:
      return open_rgbd(options);
    case DatasetFormat::kPcd:
      return open_pcd_with_camera_file(options);
    case DatasetFormat::kSim:
      return open_sim(options);
    case DatasetFormat::kMcap:
      return open_recorded(options);
  }
  throw InputError("dataset: format " +
                   config_detail::not_one_of(word_of(options.format), choices_of<DatasetFormat>()));
}

}  // namespace pocd

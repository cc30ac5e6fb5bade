// Data sets by name: torwic, toycar, rgbd, pcd, recordings; and the simulator.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pocd/input/class_map.hpp"
#include "pocd/input/dataset_reader.hpp"
#include "pocd/input/input_config.hpp"
#include "pocd/sim/sensor_model.hpp"

namespace pocd {

/// Layouts are described at the readers (readers.hpp).
enum class DatasetFormat {
  kTorwic,  ///< folders of TorWIC mapping
  kToycar,  ///< folders of Co-Fusion's synthetic sequences
  kRgbd,    ///< folders of 7-Scenes
  kPcd,     ///< folders of labelled, organised PCD files
  kSim,     ///< scenario files of the simulator
  kMcap,    ///< recordings of the bus
};
inline EnumWords<DatasetFormat> words_of(DatasetFormat) {
  return {{DatasetFormat::kTorwic, "torwic"}, {DatasetFormat::kToycar, "toycar"},
          {DatasetFormat::kRgbd, "rgbd"},     {DatasetFormat::kPcd, "pcd"},
          {DatasetFormat::kSim, "sim"},       {DatasetFormat::kMcap, "mcap"}};
}

struct DatasetOptions {
  DatasetFormat format = DatasetFormat::kMcap;
  /// Visited in order as one run; stamps are shifted to go on. Folders, or scenario files for
  /// "sim".
  std::vector<std::filesystem::path> inputs;
  int repeat = 1;               ///< frames made of each still image (pcd), >= 1
  double frame_rate_hz = 15.0;  ///< for sources without stamps
  /// Unit vector pointing down in the source's world frame; frames are rotated so that it becomes
  /// -z. Not given: the folder's gravity.txt (three numbers), or -z without one (rgbd, toycar).
  std::optional<Eigen::Vector3d> gravity_W;
  std::uint64_t seed = 1;  ///< simulator noise
  /// Intrinsics of sources that do not bring their own (pcd), or other than TorWIC's (torwic).
  std::optional<CameraModel> camera;
  /// Fixed camera pose T_W_C of sources that do not bring one (pcd).
  std::optional<Pose> T_W_C;
  /// Camera on the robot (torwic); not given: TorWIC's front camera.
  std::optional<CameraExtrinsics> extrinsics;
  /// Labels are class * label_divisor + instance for sources that know instances (pcd, sim); 1:
  /// class.
  int label_divisor = 1;
  std::optional<SensorKind> sensor;  ///< sim: instead of the scenario's
  bool with_color = true;            ///< sim: colour images cost time
  /// mcap: robots, topics, and how frames are put together, as on the bus.
  InputConfig input;
  /// mcap: classes of the masks.
  ClassMap classes;
  /// mcap: no pixel beyond it is used [m].
  double max_depth_m = 3.0;
  /// mcap: only the frames that the component took while it was recorded, in its order, as the
  /// topic pocd/frames says.
  bool as_live = false;
};

/// Throws InputError: missing or empty folder, unreadable
/// intrinsics; the text names the path. Part of the configuration library (pocd::config), since the
/// simulator's scenarios and a PCD sequence's camera are YAML.
std::unique_ptr<DatasetReader> open_dataset(const DatasetOptions& options);

}  // namespace pocd

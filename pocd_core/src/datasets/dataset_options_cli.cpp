#include "pocd/datasets/dataset_options_cli.hpp"

#include <CLI/CLI.hpp>
#include <cmath>

#include "../common/parameter_text.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/choice_option.hpp"

namespace pocd {
namespace {

/// "1,2,3" as `count` finite numbers; throws CLI::ValidationError.
std::vector<double> parse_numbers(const std::string& flag, const std::string& text,
                                  std::size_t count, const std::string& form) {
  std::vector<double> numbers;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto number = config_detail::parse_real(text.substr(begin, end - begin));
    if (!number || !std::isfinite(*number)) break;
    numbers.push_back(*number);
    begin = end + 1;
  }
  if (numbers.size() != count || begin != text.size() + 1) {
    throw CLI::ValidationError(flag, "\"" + text + "\" is not " + form);
  }
  return numbers;
}

Eigen::Vector3d parse_direction(const std::string& text) {
  const std::vector<double> n = parse_numbers("--gravity", text, 3, "x,y,z");
  const Eigen::Vector3d direction(n[0], n[1], n[2]);
  // Wide enough for directions written with few digits, narrow enough to refuse m/s^2.
  if (std::abs(direction.norm() - 1.0) > 0.01) {
    throw CLI::ValidationError("--gravity", "\"" + text + "\" is not a unit vector");
  }
  return direction.normalized();
}

CameraModel parse_camera(const std::string& text) {
  const std::vector<double> n = parse_numbers("--camera", text, 6, "width,height,fx,fy,cx,cy");
  CameraModel camera;
  if (n[0] != std::floor(n[0]) || n[1] != std::floor(n[1]) || std::abs(n[0]) > 1e6 ||
      std::abs(n[1]) > 1e6) {
    throw CLI::ValidationError("--camera", "\"" + text + "\" has no whole width and height");
  }
  camera.width = static_cast<int>(n[0]);
  camera.height = static_cast<int>(n[1]);
  camera.fx = n[2], camera.fy = n[3], camera.cx = n[4], camera.cy = n[5];
  try {
    validate(camera, "--camera");
  } catch (const InputError& error) {
    throw CLI::ValidationError(error.what());
  }
  return camera;
}

Pose parse_pose(const std::string& flag, const std::string& text) {
  const std::vector<double> n = parse_numbers(flag, text, 7, "x,y,z,qx,qy,qz,qw");
  const Eigen::Quaterniond rotation(n[6], n[3], n[4], n[5]);
  if (std::abs(rotation.norm() - 1.0) > 0.01) {  // as for directions
    throw CLI::ValidationError(flag, "\"" + text + "\" has no unit quaternion");
  }
  Pose pose = Pose::Identity();
  pose.linear() = rotation.normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(n[0], n[1], n[2]);
  return pose;
}

}  // namespace

void add_dataset_options(CLI::App& app, DatasetOptions& options) {
  std::vector<CLI::Option*> all;
  const auto add = [&](CLI::Option* option) { return all.emplace_back(option); };
  const auto add_text = [&](const std::string& flag, const auto& take, const std::string& help) {
    add(app.add_option_function<std::string>(flag, take, help));
  };

  add(add_choice<DatasetFormat, DatasetFormat>(app, "--dataset", options.format,
                                               "Format of the inputs"))
      ->required();
  add(app.add_option(
          "--input", options.inputs,
          "Folder (sim: scenario file; mcap: recording); repeat it to visit several as one run"))
      ->required()
      ->allow_extra_args(false);
  add(app.add_option("--repeat", options.repeat, "Frames made of each still image (pcd)"))
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  add(app.add_option("--rate", options.frame_rate_hz,
                     "Frames per second of inputs without stamps [Hz]"))
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  add_text(
      "--gravity",
      [&options](const std::string& text) { options.gravity_W = parse_direction(text); },
      "Unit vector x,y,z that points down in the inputs' world frame (rgbd, toycar)");
  add_text(
      "--camera", [&options](const std::string& text) { options.camera = parse_camera(text); },
      "Intrinsics width,height,fx,fy,cx,cy [px] (pcd, torwic)");
  add_text(
      "--camera-pose",
      [&options](const std::string& text) { options.T_W_C = parse_pose("--camera-pose", text); },
      "Fixed pose of the camera's optical frame in the map, x,y,z,qx,qy,qz,qw [m] (pcd)");
  add_text(
      "--mount",
      [&options](const std::string& text) {
        options.extrinsics = CameraExtrinsics{};
        options.extrinsics->T_B_C = parse_pose("--mount", text);
      },
      "Pose of the camera's optical frame on the robot, x,y,z,qx,qy,qz,qw [m] (torwic)");
  add(app.add_option("--seed", options.seed, "Seed of the simulator's noise"))
      ->check([](const std::string& text) {  // CLI11 would take "-1" as 2^64 - 1
        return config_detail::parse_natural(text) ? "" : "\"" + text + "\" is not 0, 1, 2, ...";
      })
      ->capture_default_str();
  add(add_choice<SensorKind>(app, "--sensor", options.sensor,
                             "Sensor model instead of the scenario's (sim)"));
  add(app.add_flag("--as-live", options.as_live,
                   "Only the frames that the component took while they were recorded (mcap)"));
  for (CLI::Option* option : all) option->group("Frames");
}

void add_topic_options(CLI::App& app, std::vector<std::string>& overrides) {
  const auto add = [&](const std::string& flag, const std::string& key) {
    app.add_option_function<std::string>(
           flag,
           [&overrides, key](const std::string& topic) {
             // In quotes: text that begins with {robot} would be a group of keys.
             overrides.push_back("node.topics." + key + "=\"" + topic + "\"");
           },
           "Short for --set node.topics." + key + "=TOPIC; {robot} stands for any name (mcap)")
        ->group("Frames");
  };
  add("--depth-topic", "depth");
  add("--camera-info-topic", "camera_info");
  add("--segmentation-topic", "segmentation");
  add("--color-topic", "color");
  add("--odometry-topic", "odometry");
}

}  // namespace pocd

#include "pocd/config/dataset_options_cli.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>

#include "parameter_text.hpp"

namespace pocd {
namespace {

/// "x,y,z" to a unit vector; throws CLI::ValidationError.
Eigen::Vector3d parse_direction(const std::string& text) {
  std::array<double, 3> xyz{};
  std::size_t begin = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t end = i < 2 ? text.find(',', begin) : text.size();
    const auto number = end == std::string::npos
                            ? std::nullopt
                            : config_detail::parse_real(text.substr(begin, end - begin));
    if (!number || !std::isfinite(*number)) {
      throw CLI::ValidationError("--gravity", "\"" + text + "\" is not x,y,z");
    }
    xyz[i] = *number;
    begin = end + 1;
  }
  const Eigen::Vector3d direction(xyz[0], xyz[1], xyz[2]);
  // Wide enough for directions written with few digits, narrow enough to refuse m/s^2.
  if (std::abs(direction.norm() - 1.0) > 0.01) {
    throw CLI::ValidationError("--gravity", "\"" + text + "\" is not a unit vector");
  }
  return direction.normalized();
}

}  // namespace

void add_dataset_options(CLI::App& app, DatasetOptions& options) {
  const std::string group = "Frames";
  app.add_option("--dataset", options.format, "Format of the inputs: torwic, rgbd, pcd, sim")
      ->required()
      ->group(group);
  app.add_option("--input", options.inputs,
                 "Folder (for sim: scenario YAML file); repeat it to visit several as one run")
      ->required()
      ->allow_extra_args(false)
      ->group(group);
  app.add_option("--repeat", options.repeat, "Frames made of each still image (pcd)")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str()
      ->group(group);
  app.add_option("--rate", options.frame_rate_hz, "Frames per second of inputs without stamps [Hz]")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str()
      ->group(group);
  app.add_option_function<std::string>(
         "--gravity",
         [&options](const std::string& text) { options.gravity_W = parse_direction(text); },
         "Unit vector that points down in the inputs' world frame, x,y,z [default: 0,0,-1]")
      ->group(group);
  app.add_option("--seed", options.seed, "Seed of the simulator's noise")
      ->check([](const std::string& text) {  // CLI11 would take "-1" as 2^64 - 1
        return config_detail::parse_natural(text) ? "" : "\"" + text + "\" is not 0, 1, 2, ...";
      })
      ->capture_default_str()
      ->group(group);
}

}  // namespace pocd

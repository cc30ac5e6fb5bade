#include "pocd/sim/open_source.hpp"

#include "pocd/common/check.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"

namespace pocd {

std::unique_ptr<DatasetReader> open_source(const DatasetOptions& options) {
  if (options.format != "sim") return open_dataset(options);
  Scenario scenario = load_run(options.inputs);
  if (options.sensor == "perfect") {
    scenario.sensor = SensorModel::perfect();
  } else if (options.sensor == "stereo") {
    scenario.sensor = SensorModel();
  } else if (!options.sensor.empty()) {
    throw InputError("sim: sensor '" + options.sensor + "' is unknown, one of: perfect, stereo");
  }
  SimReaderOptions reader;
  reader.seed = options.seed;
  reader.label_divisor = options.label_divisor;
  reader.with_color = options.with_color;
  return std::make_unique<SimReader>(std::move(scenario), reader);
}

}  // namespace pocd

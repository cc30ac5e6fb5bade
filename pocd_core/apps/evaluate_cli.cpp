#include "evaluate_cli.hpp"

#include <CLI/CLI.hpp>
#include <map>

#include "pocd/common/choice_option.hpp"

namespace pocd {
namespace {

const std::vector<Method> kDefaultMethods{
    Method::kPocd,           Method::kPublished,       Method::kStaticTsdf,
    Method::kTrackedObjects, Method::kVoxelCorrection, Method::kSubmaps};
const std::map<std::string, bool FaultOptions::*> kFaults{
    {"pose_jumps", &FaultOptions::pose_jumps},
    {"mask_gaps", &FaultOptions::mask_gaps},
    {"depth_holes", &FaultOptions::depth_holes}};

}  // namespace

int parse_command_line(int argc, char** argv, EvaluateOptions& o) {
  CLI::App app(
      "Compares mapping methods on routes whose last part shows a changed place.\n"
      "Example: pocd_evaluate --config config/simulated.yaml "
      "--seeds 1,2,3 --jobs 2 --output output/evaluation\n"
      "Recordings: pocd_evaluate --dataset torwic --input Scenario_1-1 --input Scenario_1-5 "
      "--config "
      "config/torwic.yaml --output output/route_1_5\n"
      "Exit code: 0 done, 1 inputs or outputs unusable, 2 usage or configuration.",
      "pocd_evaluate");
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("--scenarios", o.scenarios, "Folder of scenario files")->capture_default_str();
  app.add_option("--baseline", o.baseline, "Scenario that every route starts with")
      ->capture_default_str();
  auto* names = app.add_option("--scenario", o.names, "Scenarios to end a route with; default: all")
                    ->delimiter(',');
  app.add_option("--run", o.runs, "Scenario file with several visits, as a route of its own")
      ->allow_extra_args(false);
  auto* dataset = add_choice<DatasetFormat>(app, "--dataset", o.dataset,
                                            "Format of recordings: torwic, toycar, rgbd")
                      ->excludes(names);
  app.add_option("--input", o.inputs, "Recording; repeat it, the last one is the reference")
      ->needs(dataset)
      ->allow_extra_args(false);
  app.add_option("--suite", o.suites, "File that lists such runs, as config/evaluation/beyond.yaml")
      ->allow_extra_args(false);
  add_choices(app, "--methods", o.methods, "Methods, separated by commas");
  app.add_option("--variant", o.variants,
                 "Our method with an overlay: NAME=FILE or NAME=GROUP.KEY=VALUE[,GROUP.KEY=VALUE]")
      ->allow_extra_args(false);
  app.add_option("--variants", o.variant_files,
                 "File with variants of any method, as config/evaluation/ablation.yaml")
      ->allow_extra_args(false);
  app.add_option("--seeds", o.seeds, "Seeds of the simulator's noise, separated by commas")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option_function<std::vector<std::string>>(
         "--fault",
         [&o](const std::vector<std::string>& faults) {
           for (const std::string& fault : faults) o.faults.*kFaults.at(fault) = true;
         },
         "Faults put into the frames: pose_jumps, mask_gaps, depth_holes")
      ->delimiter(',')
      ->check(CLI::IsMember(kFaults));
  app.add_option("--sensor", o.sensor,
                 "File of a sensor model for every simulated scenario, as "
                 "config/sim/sensors/edges.yaml")
      ->excludes(dataset);
  app.add_option(
         "--sim", o.sim,
         "Change of every simulated scenario, KEY=VALUE: frame_rate_hz, width, height, fx, "
         "fy, cx, cy, or a field of the sensor model, as sensor.depth_quadratic_per_m=0.005")
      ->excludes(dataset)
      ->allow_extra_args(false);
  app.add_option("--config", o.config, "Configuration file; repeat it to overlay several")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--method-config", o.method_config,
                 "Parameters of the methods that ours is compared with, as "
                 "config/evaluation/published_toycar.yaml; repeat it to overlay several")
      ->allow_extra_args(false);
  app.add_option("--set", o.overrides, "Override one parameter: GROUP.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--output", o.output, "Folder for tables and pictures, made if missing")
      ->required();
  app.add_option("--jobs", o.jobs, "Routes evaluated at the same time")->check(CLI::Range(1, 64));
  app.add_flag("--quick", o.quick, "Few scenarios, one seed");
  app.add_flag("!--no-reference", o.with_reference,
               "Leave out the map of the last visit alone and the columns that need it: a third "
               "less work");
  app.add_flag("!--no-pictures", o.pictures, "Tables only");
  app.add_option("--voxel-size", o.voxel_size_m, "Voxels that are compared [m]")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  app.add_option("--min-height", o.min_height_m,
                 "Surface below is not judged: the floor [m, map frame]")
      ->capture_default_str();
  app.add_option("--max-height", o.max_height_m, "Surface above is not judged [m, map frame]")
      ->capture_default_str();
  try {
    app.parse(argc, argv);
    if (o.dataset && o.inputs.empty()) throw CLI::RequiredError("--input");
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (o.methods.empty() && o.variant_files.empty()) o.methods = kDefaultMethods;
  if (o.quick) {
    if (o.names.empty()) o.names = {"0", "1-5", "2-2", "4-1"};
    o.seeds.resize(1);
  }
  return -1;
}

}  // namespace pocd

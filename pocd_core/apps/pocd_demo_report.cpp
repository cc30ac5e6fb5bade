// Prints what really changed in a simulated run beside what the system reported.
#include <CLI/CLI.hpp>
#include <iostream>

#include "pocd/common/check.hpp"
#include "pocd/eval/change_report.hpp"
#include "pocd/sim/scenario_yaml.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Prints what really changed in a simulated run beside the events in a CSV file.\n"
      "Example: pocd_demo_report --scenario config/sim/demo.yaml --events output/demo/events.csv\n"
      "Exit code: 0 printed, 1 a file cannot be used, 2 usage.",
      "pocd_demo_report");
  std::vector<std::filesystem::path> scenarios;
  std::filesystem::path events;
  // Half of a stack's width: boxes are fitted to the sides that were seen.
  double radius_m = 0.6;
  app.add_option("--scenario", scenarios, "Scenario file; repeat it as in the run")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--events", events, "events.csv of the run")->required();
  app.add_option("--radius", radius_m, "How far a report may be from the true place [m]")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    std::cout << pocd::format_report(
        pocd::compare_changes(pocd::load_run(scenarios), pocd::read_events_csv(events), radius_m));
    return std::cout.flush() ? 0 : 1;
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_demo_report: " << error.what() << '\n';
    return 1;
  }
}

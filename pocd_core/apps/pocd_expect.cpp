// Whether a run reported what it should: for tests of a site, by exit code.
#include <CLI/CLI.hpp>
#include <iostream>

#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/eval/expected_changes.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Compares the events of a run, as pocd_mirror and pocd_map write them, with what is "
      "expected.\n"
      "Example: pocd_expect --expected expected.yaml --events output/events.csv\n"
      "Exit code: 0 all is as expected, 1 it is not, or a file cannot be used, 2 usage.",
      "pocd_expect");
  std::filesystem::path expected_file, events_file;
  app.set_version_flag("--version", POCD_VERSION);
  CLI::Option* const expected_option =
      app.add_option("--expected", expected_file, "YAML file: changes, others; see --explain");
  CLI::Option* const events_option =
      app.add_option("--events", events_file, "events.csv of the run");
  bool explain = false;
  app.add_flag("--explain", explain, "Print the page of what the YAML file may say and end");
  try {
    app.parse(argc, argv);
    if (!explain && (expected_option->empty() || events_option->empty())) {
      throw CLI::RequiredError("--expected and --events");
    }
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (explain) {
    std::cout << pocd::parameters_markdown<pocd::ExpectedChanges>();
    return std::cout.flush() ? 0 : 1;
  }
  try {
    pocd::ExpectedChanges expected;
    pocd::load_config(expected, {expected_file});
    const auto wrong = pocd::disappointments(expected, pocd::read_events_csv(events_file));
    for (const std::string& line : wrong) std::cout << line << '\n';
    if (wrong.empty()) {
      std::cout << "as expected: " << expected.changes.size() << " changes\n";
    }
    return std::cout.flush() && wrong.empty() ? 0 : 1;
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_expect: " << error.what() << '\n';
    return 1;
  }
}

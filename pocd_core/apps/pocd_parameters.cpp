// Prints every parameter: as the Markdown page docs/parameters.md, or as YAML with given files
// applied.
#include <CLI/CLI.hpp>
#include <iostream>

#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/pipeline/pipeline_config.hpp"

namespace {

constexpr const char* kIntroduction =
    "# Parameters\n\n"
    "Written by `pocd_parameters`; do not edit. Defaults are those of the warehouse setting. A\n"
    "configuration file gives only what differs from them, as nested YAML:\n"
    "`map.voxel_size_m` is the key `voxel_size_m` under `map`. Several files overlay each other "
    "in\n"
    "the order of the command line, a list replaces the whole list before it, and `--set\n"
    "map.voxel_size_m=0.1` comes last. Unknown keys, wrong types and values out of range are "
    "errors,\n"
    "listed all at once.\n\n";

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Prints every parameter with default, range and meaning as Markdown; with --config, the "
      "effective values as YAML.\nExample: pocd_parameters --config config/torwic.yaml",
      "pocd_parameters");
  std::vector<std::filesystem::path> files;
  std::vector<std::string> overrides;
  bool as_yaml = false;
  app.add_option("--config", files, "Configuration files, later ones override earlier ones")
      ->allow_extra_args(false);
  app.add_option("--set", overrides, "Override one parameter: GROUP.KEY=VALUE")
      ->allow_extra_args(false);
  app.add_flag("--yaml", as_yaml, "Print the default values as YAML");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    pocd::PipelineConfig config;
    pocd::load_config(config, files, overrides);
    if (as_yaml || !files.empty() || !overrides.empty()) {
      std::cout << pocd::dump_config(config);
    } else {
      std::cout << kIntroduction << pocd::parameters_markdown<pocd::PipelineConfig>();
    }
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_parameters: " << error.what() << '\n';
    return 2;
  }
  return std::cout.flush() ? 0 : 1;
}

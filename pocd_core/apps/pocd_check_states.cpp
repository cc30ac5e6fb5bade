// Runs the pipeline on recordings whose truth is known and prints what it holds beside what is
// there.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>

#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"
#include "pocd/eval/state_check.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace {

int check_states(const std::filesystem::path& folder, const std::filesystem::path& truth_file,
                 const pocd::PipelineConfig& config, bool with_masks) {
  pocd::StateTruth truth;
  pocd::load_config(truth, {truth_file});
  const pocd::StateRun run = pocd::run_states(
      truth, folder, config,
      [](const pocd::StateRun& so_far) {
        std::cout << pocd::describe_last_state(so_far) << std::flush;
      },
      with_masks);
  std::size_t listed = 0, box = 0;
  for (const pocd::StateVerdict& verdict : run.verdicts) {
    listed += verdict.ok_listed;
    box += verdict.ok_box;
  }
  std::cout << listed << " of " << run.verdicts.size() << " states right (" << box
            << " by the centres of boxes)\n";
  return listed == run.verdicts.size() ? 0 : 1;
}

int check_still(const pocd::DatasetOptions& options, const pocd::PipelineConfig& config,
                std::size_t max_frames) {
  const auto reader = pocd::open_dataset(options);
  pocd::PocdPipeline pipeline(config);
  std::size_t frames = 0, added = 0, wrong = 0;
  while (const auto frame = reader->next()) {
    if (frames == max_frames) break;
    ++frames;
    for (const pocd::ObjectEvent& event : pipeline.process_frame(*frame).events) {
      added += event.kind == pocd::EventKind::kAdded;
      if (event.kind != pocd::EventKind::kRemoved && event.kind != pocd::EventKind::kMoved)
        continue;
      ++wrong;
      const Eigen::Vector3d& p = event.box.pose.position_W;
      const Eigen::Vector3d& s = event.box.size_m;
      std::printf("frame %llu  %s object %u  at %.2f %.2f %.2f  size %.2f %.2f %.2f  %s\n",
                  static_cast<unsigned long long>(event.frame_sequence), to_string(event.kind),
                  to_index(event.object), p.x(), p.y(), p.z(), s.x(), s.y(), s.z(),
                  event.evidence.rule.c_str());
    }
  }
  for (const std::string& problem : reader->problems()) std::cerr << "skipped: " << problem << '\n';
  std::printf("%zu frames, %zu objects added, %zu held, %zu false changes\n", frames, added,
              pipeline.objects().size(), wrong);
  return wrong == 0 && frames > 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Checks the pipeline on recordings whose truth is known: --states, a labelled table in "
      "several "
      "states; --still, a hand-held video of a place where nothing changes.\n"
      "Example: pocd_check_states --states tabletop_states --truth test/data/tabletop_truth.yaml "
      "--config config/tabletop.yaml\n"
      "Exit code: 0 all right, 1 something wrong or unreadable, 2 usage or configuration.",
      "pocd_check_states");
  std::filesystem::path states, truth, still;
  std::vector<std::filesystem::path> files;
  std::vector<std::string> overrides;
  std::vector<double> gravity;
  std::size_t max_frames = 0;
  bool with_masks = true;
  app.set_version_flag("--version", POCD_VERSION);
  auto* states_option =
      app.add_option("--states", states, "Folder of labelled PCD files, one per state");
  app.add_flag("!--no-masks", with_masks,
               "Leave the labels out: what is a thing is told by geometry")
      ->needs(states_option);
  app.add_option("--truth", truth, "Truth of the states (YAML)")->needs(states_option);
  auto* still_option = app.add_option("--still", still, "Folder of frames in the rgbd layout");
  still_option->excludes(states_option);
  app.add_option("--gravity", gravity, "Direction down in the frames' world (three numbers)")
      ->expected(3)
      ->needs(still_option);
  app.add_option("--max-frames", max_frames, "Stop after that many frames")->needs(still_option);
  app.add_option("--config", files, "Configuration file; repeat it to overlay several")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--set", overrides, "Override one parameter: GROUP.KEY=VALUE")
      ->allow_extra_args(false);
  try {
    app.parse(argc, argv);
    if (states.empty() == still.empty()) throw CLI::ValidationError("give --states or --still");
    if (!states.empty() && truth.empty()) throw CLI::ValidationError("--states needs --truth");
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  pocd::PipelineConfig config;
  try {
    pocd::load_config(config, files, overrides);
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_check_states: " << error.what() << '\n';
    return 2;
  }
  try {
    if (!states.empty()) return check_states(states, truth, config, with_masks);
    pocd::DatasetOptions options;
    options.format = pocd::DatasetFormat::kRgbd;
    options.inputs = {still};
    if (!gravity.empty())
      options.gravity_W = Eigen::Vector3d(gravity[0], gravity[1], gravity[2]).normalized();
    return check_still(options, config,
                       max_frames == 0 ? static_cast<std::size_t>(-1) : max_frames);
  } catch (const std::exception& error) {
    std::cerr << "pocd_check_states: " << error.what() << '\n';
    return 1;
  }
}

// The past of a warehouse, from the log of its memory.
#include <CLI/CLI.hpp>
#include <iostream>

#include "history_table.hpp"
#include "pocd/common/check.hpp"
#include "pocd/common/choice_option.hpp"

namespace {

struct Options {
  std::filesystem::path folder;
  pocd::TableFormat format = pocd::TableFormat::kCsv;
  std::string time, from, to;
  std::uint32_t object = 0;
  std::uint64_t after = 0;
  double least_m = 0.05;
};

void show(const CLI::App& app, const Options& options) {
  pocd::MemoryReader log(options.folder);
  pocd::History history(log);
  const auto names = log.class_names();
  const auto name_of = [&](pocd::ClassId id) {
    const auto name = names.find(id);
    return name == names.end() ? "class_" + std::to_string(id) : name->second;
  };
  const auto add_event = [&](pocd::HistoryTable& table, const pocd::LoggedEvent& logged) {
    table.row(to_string(logged.event.kind), logged, name_of(logged.event.class_id),
              logged.event.previous_box);
  };
  if (app.got_subcommand("at")) {
    const pocd::HistoryState state = history.state_at(pocd::parse_time(options.time));
    pocd::HistoryTable table(std::cout, options.format);
    for (const auto& entry : state) add_event(table, entry.second);
  } else if (app.got_subcommand("diff")) {
    const auto list = history.between(pocd::parse_time(options.from), pocd::parse_time(options.to),
                                      options.least_m);
    pocd::HistoryTable table(std::cout, options.format);
    for (const pocd::Difference& d : list) {
      table.row(to_string(d.kind), d.evidence, name_of(d.evidence.event.class_id), d.before);
    }
  } else if (app.got_subcommand("object")) {
    const auto life = history.life_of(static_cast<pocd::ObjectId>(options.object));
    pocd::HistoryTable table(std::cout, options.format);
    for (const pocd::LoggedEvent& logged : life) add_event(table, logged);
  } else {
    pocd::HistoryTable table(std::cout, options.format);
    std::uint64_t after = options.after;
    constexpr std::size_t kPage = 1000;
    for (std::size_t got = kPage; got == kPage;) {
      const auto page = log.events(after, kPage);
      for (const pocd::LoggedEvent& logged : page) {
        add_event(table, logged);
        after = logged.event.sequence;
      }
      got = page.size();
    }
  }
  if (log.damaged_events() > 0) {
    std::cerr << "pocd_history: " << log.damaged_events() << " damaged events left out\n";
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Tells from the memory of a node, also while it runs, what stood where and what happened.\n"
      "Times are stamps of the frames: nanoseconds, seconds with a decimal point, or UTC as "
      "2026-11-29T02:00:00Z.\n"
      "Example: pocd_history diff /var/lib/pocd --from 2026-11-28T06:00:00Z --to "
      "2026-11-29T06:00:00Z\n"
      "Exit code: 0 done, 1 the memory cannot be read, 2 usage.",
      "pocd_history");
  Options options;
  app.set_version_flag("--version", POCD_VERSION);
  app.require_subcommand(1);
  const auto add = [&](const char* name, const char* text) {
    CLI::App* sub = app.add_subcommand(name, text);
    sub->add_option("folder", options.folder, "Folder of the memory")->required();
    pocd::add_choice(*sub, "--format", options.format, "csv or json");
    return sub;
  };
  add("at", "The objects at a time, each with the last event about it")
      ->add_option("--time", options.time, "Time")
      ->required();
  CLI::App* diff = add("diff", "What is different at the second time, with its evidence");
  diff->add_option("--from", options.from, "First time")->required();
  diff->add_option("--to", options.to, "Second time")->required();
  diff->add_option("--least", options.least_m, "Changes of place and size below this are none [m]")
      ->capture_default_str();
  add("object", "The life of one object")
      ->add_option("id", options.object, "Its number in the memory")
      ->required();
  add("events", "The log")->add_option("--after", options.after, "Only events after this number");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    show(app, options);
    return std::cout.flush() ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << "pocd_history: " << error.what() << '\n';
    return 1;
  }
}

// Says something of the map to the component, and waits for its answer.
#include <cstdio>
#include <random>

#include "apps/common.hpp"
#include "pocd/pipeline/operator_word.hpp"
#include "pocd_dds/bridge/object_messages.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace {

using pocd::InputError;
using pocd::WordKind;
using Clock = std::chrono::steady_clock;

struct Options {
  pocd::dds::BusOptions bus;
  std::uint32_t map_id = 0;
  double timeout_s = 30.0;
  WordKind kind = WordKind::kSave;
  std::string object, polygon, region, by;
};

std::array<std::uint8_t, 16> random_name() {
  std::random_device device;
  std::array<std::uint8_t, 16> name{};
  for (std::uint8_t& byte : name) byte = static_cast<std::uint8_t>(device());
  return name;
}

/// "x,y x,y x,y" [m].
std::vector<pocd_msgs::msg::Corner> corners_of(const std::string& text) {
  std::vector<pocd_msgs::msg::Corner> corners;
  const char* at = text.c_str();
  while (true) {
    while (*at == ' ') ++at;
    if (*at == '\0') return corners;
    pocd_msgs::msg::Corner corner;
    char* end = nullptr;
    corner.x(std::strtod(at, &end));
    const bool x = end != at && *end == ',';
    at = x ? end + 1 : at;
    corner.y(std::strtod(at, &end));
    if (!x || end == at || (*end != ' ' && *end != '\0')) {
      throw InputError("--polygon \"" + text + "\": expected corners as \"x,y x,y x,y\"");
    }
    at = end;
    corners.push_back(corner);
  }
}

/// A uuid as 32 hexadecimal digits, or the number of an object of the lineage.
std::array<std::uint8_t, 16> uuid_of(const std::string& text, std::uint64_t lineage) {
  const bool digits = text.find_first_not_of("0123456789") == std::string::npos;
  if (!text.empty() && text.size() <= 10 && digits) {
    return pocd::dds::object_uuid(lineage, static_cast<pocd::ObjectId>(std::stoull(text)));
  }
  if (text.size() != 32 || text.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos) {
    throw InputError("object \"" + text + "\": expected its number or 32 hexadecimal digits");
  }
  std::array<std::uint8_t, 16> uuid{};
  for (std::size_t i = 0; i < 16; ++i) {
    uuid[i] = static_cast<std::uint8_t>(std::stoul(text.substr(2 * i, 2), nullptr, 16));
  }
  return uuid;
}

class Asking {
 public:
  explicit Asking(const Options& options)
      : options_(options),
        participant_(std::make_shared<pocd::dds::Participant>(options.bus)),
        manifests_(participant_, pocd::dds::topics::kMapManifest, wakeup_),
        commands_(participant_, pocd::dds::topics::kCommand),
        replies_(participant_, pocd::dds::topics::kCommandReply, wakeup_),
        end_(Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                std::chrono::duration<double>(options.timeout_s))) {}

  int run() {
    pocd_msgs::msg::Command command;
    command.requester(random_name());
    command.number(1);
    command.map_id(options_.map_id);
    command.kind(static_cast<std::uint8_t>(options_.kind));
    command.polygon(corners_of(options_.polygon));
    command.region(options_.region);
    command.by(options_.by);
    if (!options_.object.empty()) uuid_of(options_.object, 0);  // wrong ones before any waiting
    std::optional<std::uint64_t> lineage;
    if (!wait([&] {
          if (const auto heard = take_lineage()) lineage = heard;
          return lineage && commands_.matched() > 0 && replies_.matched() > 0;
        })) {
      throw InputError("no node with map " + std::to_string(options_.map_id) +
                       " takes commands on domain " + std::to_string(options_.bus.domain) +
                       " (node.commands)");
    }
    if (!options_.object.empty()) command.uuid(uuid_of(options_.object, *lineage));
    if (!commands_.write(command)) throw InputError(commands_.topic() + ": cannot be written");
    std::optional<pocd_msgs::msg::CommandReply> reply;
    if (!wait([&] { return (reply = take_reply(command)).has_value(); })) {
      throw InputError("the node has not answered in time: whether it was done is not known");
    }
    std::printf("%s: %s%s\n", reply->done() ? "done" : "not done", reply->text().c_str(),
                reply->stored() ? ("; event " + std::to_string(reply->seq())).c_str() : "");
    return reply->done() ? 0 : 1;
  }

 private:
  template <class Condition>
  bool wait(const Condition& condition) {
    while (!pocd::dds::stop_requested && Clock::now() < end_) {
      if (condition()) return true;
      wakeup_.wait_for(std::chrono::milliseconds(50));
    }
    return false;
  }
  std::optional<std::uint64_t> take_lineage() {
    pocd_msgs::msg::MapManifest manifest;
    pocd::dds::SampleMeta meta;
    std::optional<std::uint64_t> lineage;
    while (manifests_.take(manifest, meta)) {
      if (!meta.valid || manifest.map_id() != options_.map_id || manifest.final_version()) continue;
      lineage = manifest.lineage();
    }
    return lineage;
  }
  std::optional<pocd_msgs::msg::CommandReply> take_reply(const pocd_msgs::msg::Command& command) {
    pocd_msgs::msg::CommandReply reply;
    pocd::dds::SampleMeta meta;
    while (replies_.take(reply, meta)) {
      if (meta.valid && reply.requester() == command.requester()) return reply;
    }
    return std::nullopt;
  }

  const Options& options_;
  pocd::dds::Wakeup wakeup_;
  std::shared_ptr<pocd::dds::Participant> participant_;
  pocd::dds::Reader<pocd_msgs::msg::MapManifestPubSubType> manifests_;
  pocd::dds::Writer<pocd_msgs::msg::CommandPubSubType> commands_;
  pocd::dds::Reader<pocd_msgs::msg::CommandReplyPubSubType> replies_;
  const Clock::time_point end_;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Tells the component (with node.commands) what a person knows of the map, and prints its "
      "answer.\n"
      "Example: pocd_command ignore-region dock --polygon \"0,0 4,0 4,3\" --by mira\n"
      "Exit code: 0 done, 1 not done or no answer, 2 usage.",
      "pocd_command");
  Options options;
  options.bus.name = "pocd_command";
  app.set_version_flag("--version", POCD_VERSION);
  app.require_subcommand(1);
  const auto add = [&](const char* name, const char* text, WordKind kind) {
    CLI::App* sub = app.add_subcommand(name, text);
    sub->fallthrough();
    sub->callback([&options, kind] { options.kind = kind; });
    return sub;
  };
  const auto object = [&](CLI::App* sub) {
    sub->add_option("object", options.object, "Its number, or its uuid as 32 hexadecimal digits")
        ->required();
  };
  const auto polygon = [&](CLI::App* sub) {
    sub->add_option("--polygon", options.polygon, "Corners \"x,y x,y x,y\" in the map frame [m]")
        ->required();
  };
  object(add("forget-object", "It is known no more, and is added anew when it is seen",
             WordKind::kForgetObject));
  object(add("confirm-removal", "It is gone: reported as REMOVED", WordKind::kConfirmRemoval));
  polygon(add("forget-region", "The same for all that stands in a region, and the map there",
              WordKind::kForgetRegion));
  CLI::App* ignore = add("ignore-region", "What is seen in or through a region is not used",
                         WordKind::kIgnoreRegion);
  ignore->add_option("region", options.region, "Its name")->required();
  polygon(ignore);
  add("heed-region", "Ends ignore-region", WordKind::kHeedRegion)
      ->add_option("region", options.region, "Its name")
      ->required();
  add("reset", "Everything is known no more", WordKind::kReset);
  add("save", "The memory is written at once", WordKind::kSave);
  app.add_option("--by", options.by, "Who says so, for the log")->envname("USER")->required();
  app.add_option("--map-id", options.map_id, "node.map_id of the component")->capture_default_str();
  app.add_option("--timeout", options.timeout_s, "Seconds to wait for the answer")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  int domain = -1;
  pocd::dds::add_bus_options(app, domain, options.bus.profiles_file, options.bus.security_folder);
  try {
    app.parse(argc, argv);
    options.bus.domain = domain >= 0 ? domain : pocd::dds::default_domain();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const InputError& error) {
    std::cerr << "pocd_command: " << error.what() << '\n';
    return 2;
  }
  return pocd::dds::guarded("pocd_command", [&] {
    pocd::dds::log_to_stderr("pocd_command");
    pocd::dds::stop_on_signals();
    return Asking(options).run();
  });
}

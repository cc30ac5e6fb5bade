// Serves a page that shows the map, the objects and what changed: live, of a recording, of a
// memory.
#include <boost/asio/ip/address.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "apps/common.hpp"
#include "apps/heap_return.hpp"
#include "view/feed.hpp"
#include "view/recorded.hpp"
#include "view/remembered.hpp"
#include "view/server.hpp"

namespace {

struct Options {
  std::vector<std::string> inputs;  // none: the bus
  int past_mb = 256;
  pocd::view::FeedOptions feed;
  pocd::view::ServerOptions server;
};

namespace view = pocd::view;

/// What is shown: recordings, a memory, or the bus.
std::unique_ptr<view::Source> source_of(const Options& options, view::Board& board) {
  if (options.inputs.empty()) return std::make_unique<view::Feed>(options.feed, board);
  const std::filesystem::path first = options.inputs.front();
  if (std::filesystem::exists(first / "memory.sqlite")) {
    if (options.inputs.size() > 1)
      throw pocd::InputError("one memory at a time: " + first.string());
    return std::make_unique<view::Remembered>(first, board);
  }
  view::RecordedOptions recorded;
  recorded.inputs.assign(options.inputs.begin(), options.inputs.end());
  recorded.map_id = options.feed.map_id;
  recorded.map_frame = options.feed.map_frame;
  recorded.robots = options.feed.robots;
  return std::make_unique<view::Recorded>(recorded, board);
}

int serve(const Options& options) {
  const view::StaticFiles files(view::StaticFiles::installed());
  view::Board board(static_cast<std::size_t>(options.past_mb) << 20);
  const std::unique_ptr<view::Source> source = source_of(options, board);
  pocd::dds::BusOptions bus{options.feed.domain, options.feed.profiles_file, ""};
  bus.security_folder = options.feed.security_folder;
  view::Relay relay(bus);
  const view::Server server(options.server, files, board, source.get(), relay);
  const bool local = options.server.address == "127.0.0.1";
  const bool v6 = options.server.address.find(':') != std::string::npos;
  const std::string host = local ? "localhost"
                           : v6  ? '[' + options.server.address + ']'
                                 : options.server.address;
  const std::string query = options.server.token.empty() ? "" : "?token=" + options.server.token;
  std::printf("http://%s:%u/%s\n", host.c_str(), server.port(), query.c_str());
  std::fflush(stdout);
  if (!local && options.server.address != "::1" && options.server.token.empty()) {
    spdlog::warn("everybody who reaches {} sees the map: --token asks for one",
                 options.server.address);
  }
  pocd::dds::HeapReturn heap;
  while (!pocd::dds::stop_requested) {
    heap.turn();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Serves a page that shows map, objects and changes as they come, and the same to viewers "
      "that\n"
      "speak the Foxglove WebSocket protocol. Prints its address.\n"
      "With recordings (MCAP, .db3) or the folder of a memory it needs no bus and no node.\n"
      "Examples: pocd_view --port 8080\n"
      "          pocd_view run.mcap\n"
      "          pocd_view /var/lib/pocd\n"
      "Exit code: 0 ended by a signal, 1 it cannot listen or has no bus, 2 usage.",
      "pocd_view");
  Options options;
  app.set_version_flag("--version", POCD_VERSION);
  app.add_option("input", options.inputs,
                 "Recordings of one run, in order, or the folder of a memory; none: the bus");
  app.add_option("--past-mb", options.past_mb,
                 "Memory for surfaces that were replaced, for the map of another time [MB]")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  app.add_option("--address", options.server.address, "Address to listen on, 0.0.0.0 for all")
      ->check([](const std::string& text) {
        boost::system::error_code error;
        boost::asio::ip::make_address(text, error);
        return error ? "is no address of this machine like 127.0.0.1: " + text : std::string();
      })
      ->capture_default_str();
  app.add_option("--port", options.server.port, "TCP port; 0 takes one that is free")
      ->capture_default_str();
  app.add_option(
         "--token", options.server.token,
         "Let only those in who give it in the page's address, ?token=...; letters, digits, - "
         "and _")
      ->envname("POCD_VIEW_TOKEN")
      ->check([](const std::string& text) {
        const bool plain = text.find_first_not_of(
                               "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                               "0123456789-_") == std::string::npos;
        return plain && !text.empty() ? std::string() : "has to be letters, digits, - and _";
      });
  app.add_option("--allow-origin", options.server.allowed_origins,
                 "Origin of another page that may connect, like https://app.foxglove.dev; may be "
                 "repeated");
  app.add_option("--max-clients", options.server.most_clients, "Pages and viewers at once")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--map-id", options.feed.map_id, "Which map: node.map_id of its publisher")
      ->capture_default_str();
  app.add_option("--map-frame", options.feed.map_frame, "Frame of the map: its node.map_frame")
      ->capture_default_str();
  app.add_option("--odometry-topic", options.feed.robots.odometry, "Of a robot, for its camera")
      ->capture_default_str();
  app.add_option("--camera-info-topic", options.feed.robots.camera_info,
                 "Of a robot, for its camera")
      ->capture_default_str();
  int domain = -1;
  pocd::dds::add_bus_options(app, domain, options.feed.profiles_file, options.feed.security_folder);
  try {
    app.parse(argc, argv);
    options.feed.domain = domain >= 0 ? domain : pocd::dds::default_domain();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const pocd::InputError& error) {
    std::cerr << "pocd_view: " << error.what() << '\n';
    return 2;
  }
  return pocd::dds::guarded("pocd_view", [&] {
    pocd::dds::log_to_stderr("pocd_view");
    pocd::dds::stop_on_signals();
    return serve(options);
  });
}

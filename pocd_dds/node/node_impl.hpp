// What a node consists of, and which of its threads uses what.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "pocd/pipeline/pocd_pipeline.hpp"
#include "pocd_dds/node/command_desk.hpp"
#include "pocd_dds/node/event_feed.hpp"
#include "pocd_dds/node/frame_log.hpp"
#include "pocd_dds/node/latency_log.hpp"
#include "pocd_dds/node/look_publication.hpp"
#include "pocd_dds/node/map_publication.hpp"
#include "pocd_dds/node/node.hpp"
#include "pocd_dds/node/node_memory.hpp"
#include "pocd_dds/node/object_publication.hpp"
#include "pocd_dds/node/rival_watch.hpp"
#include "pocd_dds/node/ros_graph.hpp"
#include "pocd_dds/node/ros_outputs.hpp"

namespace pocd::dds {

struct Node::Impl {
  using Clock = std::chrono::steady_clock;

  explicit Impl(const NodeOptions& options);
  ~Impl();

  /// What a thread ends with is what run() throws. Threads have names for debuggers and `top -H`.
  void guard(const char* name, const std::function<void()>& task);
  void work();
  void tell();
  void draw();
  static void stop(std::atomic<bool>& over, Wakeup& wakeup, std::thread& thread);
  void process(const Frame& frame);
  /// Does what operators have said meanwhile; true when something was done.
  bool follow_words();
  void publish(bool now);
  /// What is wrong on the bus beside the robots' topics.
  void add_problems(IntakeStatus& input);
  NodeState judge(const IntakeStatus& input, const WorkStatus& work, const std::string& word);
  void send_status(const std::string& word);
  void send_outputs(bool last);
  void answer_words();
  void turn();
  bool finish();

  const NodeFile config;
  const std::function<void(const NodeReport&, const pocd_msgs::msg::NodeHealth&)> on_status;
  BusWatch watch;  // outlives the participant
  const std::shared_ptr<Participant> participant;
  PocdPipeline pipeline;  // worker only
  NodeMemory keeper;      // worker only, but for its status
  LatencyLog latency;
  FrameQueue queue;
  Wakeup wakeup;

  // Written by the telling thread, filled by the worker; both guard themselves.
  Wakeup tellers_wakeup;
  std::atomic<bool> told{false};

  // The drawing thread only, until it has ended; but for what is thread-safe.
  Wakeup outputs_wakeup;
  RosOutputs outputs;
  NodeClock clock;  // thread-safe
  std::atomic<bool> drawn{false};
  std::atomic<std::uint64_t> draws_failed{0};

  // run()'s thread only.
  RivalWatch rivals;
  ProblemCounter problems;
  Clock::time_point status_sent{};
  bool map_waits = false;
  bool ending = false, failing = false;  // the latter by the last status

  // Guards everything below that several threads use; the map has a lock of its own, because only
  // its data is so large that encoding and writing it would hold up the others.
  mutable std::mutex mutex;
  FrameLog frames;
  ObjectPublication objects;
  MapPublication map;
  Pulse worker_pulse, teller_pulse;
  std::unique_ptr<EventFeed> feed;         // run()'s thread only; null without a memory
  std::unique_ptr<LookPublication> looks;  // guards itself; null without a memory
  std::unique_ptr<CommandDesk> desk;       // guards itself; null without node.commands
  WorkStatus counts;
  double busy_ms = 0.0;
  std::uint64_t busy_frames = 0;
  std::exception_ptr failure;
  std::atomic<bool> failed{false}, worked{false};

  // run()'s thread only; its writers are made after all others.
  std::unique_ptr<StatusPublication> status;
  std::unique_ptr<RosGraph> graph;
  HealthRule health;

  std::unique_ptr<Intake> intake;
  std::thread worker, teller, drawer;
};

}  // namespace pocd::dds

// A run with a memory that is ended and taken up again where it was stored last.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pocd/common/archive.hpp"
#include "pocd/map/map_io.hpp"
#include "pocd/memory/memory_reader.hpp"
#include "pocd/memory/warehouse_memory.hpp"
#include "pocd/sim/scenario_yaml.hpp"
#include "pocd/sim/sim_reader.hpp"
#include "scratch_folder.hpp"
#include "test_room.hpp"

namespace pocd::test {

inline std::vector<Frame> frames_of(const Scenario& scenario) {
  SimReaderOptions options;
  options.with_color = false;
  SimReader reader(scenario, options);
  std::vector<Frame> list;
  while (auto frame = reader.next()) list.push_back(std::move(*frame));
  return list;
}

/// Three laps of two robots in the small warehouse, with a small camera at a low rate: things are
/// added, moved and removed.
inline const std::vector<Frame>& circuit_frames() {
  static const std::vector<Frame> frames = [] {
    Scenario scenario =
        load_scenario(std::filesystem::path(POCD_SOURCE_DIR) / "config/sim/demo.yaml");
    CameraModel& c = scenario.camera;
    c = {c.width / 4, c.height / 4, c.fx / 4, c.fy / 4, c.cx / 4, c.cy / 4};
    scenario.frame_rate_hz = 3.0;
    return frames_of(scenario);
  }();
  return frames;
}

/// Two robots, two short laps, a box that goes.
inline const std::vector<Frame>& small_frames() {
  static const std::vector<Frame> frames = frames_of(load_scenario(
      std::filesystem::path(POCD_SOURCE_DIR) / "test/integration/recording/small_run.yaml"));
  return frames;
}

inline PipelineConfig circuit_config() {
  PipelineConfig config = room_config();
  config.pose_gate.max_speed_mps = 100.0;
  return config;
}

/// What a run leaves, in full.
struct Outcome {
  std::string digest, voxels;
  std::vector<std::vector<std::uint8_t>> pieces;
  std::vector<std::string> events;
};

inline std::string line(const ObjectEvent& e) {
  return std::to_string(e.sequence) + " " + to_string(e.kind) + " " +
         std::to_string(to_index(e.object)) + " " + std::to_string(e.stamp_ns) + " " +
         e.evidence.rule + " " + std::to_string(e.evidence.delta_m) + " " +
         std::to_string(e.box.pose.position_W.x()) + " " + std::to_string(e.evidence.after.alpha);
}

/// A pipeline with its publisher, and perhaps a memory, between two ends.
class MemoryRunner {
 public:
  /// Goes on from what the folder holds; without a folder, from nothing.
  explicit MemoryRunner(const PipelineConfig& config, const std::filesystem::path& folder = {},
                        const MemoryConfig& keep = {})
      : config_(config), pipeline_(config), publisher_(7, config.map) {
    if (folder.empty()) return;
    MemoryConfig memory = keep;
    memory.folder = folder.string();
    memory_.emplace(memory, config.map);
    memory_->restore(pipeline_, publisher_);
    if (memory_->holds_something()) unarchive(memory_->progress(), "progress", next_);
    stamp_ns_ = memory_->stamp_ns();
    memory_->start(pipeline_, config.classes, {7, "test", 0});
  }

  std::uint64_t next() const { return next_; }
  bool process(const std::vector<Frame>& frames) {
    if (next_ == frames.size()) return false;
    process(frames[next_++]);
    return true;
  }
  void process(const Frame& frame) {
    const FrameResult result = pipeline_.process_frame(frame);
    stamp_ns_ = frame.stamp_ns;
    events_.insert(events_.end(), result.events.begin(), result.events.end());
    if (memory_) memory_->add(result);
    if (const auto word = says ? says(next_, pipeline_) : std::nullopt) {
      const WordOutcome outcome = pipeline_.apply(*word);
      EXPECT_TRUE(outcome.done) << outcome.text;
      events_.insert(events_.end(), outcome.result.events.begin(), outcome.result.events.end());
      if (memory_) memory_->add(outcome.result);
    }
  }
  /// What an operator says after so many frames.
  std::function<std::optional<OperatorWord>(std::uint64_t frames, const PocdPipeline&)> says;
  void publish() { publisher_.update(pipeline_.map()); }
  void step() {
    publish();
    memory_->step(pipeline_, publisher_, stamp_ns_, archived(next_));
  }
  bool finish() {
    publish();
    return memory_->finish(pipeline_, publisher_, stamp_ns_, archived(next_));
  }

  Outcome outcome(const std::filesystem::path& scratch) {
    publish();
    Outcome all;
    all.digest = publisher_.digest().hex();
    save_map(pipeline_.map(), scratch);
    std::ifstream in(scratch, std::ios::binary);
    all.voxels = {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    for (const ObjectEvent& e : events_) all.events.push_back(line(e));
    return all;
  }

  PocdPipeline& pipeline() { return pipeline_; }
  MapPublisher& publisher() { return publisher_; }
  WarehouseMemory& memory() { return *memory_; }
  const std::vector<ObjectEvent>& events() const { return events_; }

 private:
  const PipelineConfig config_;
  PocdPipeline pipeline_;
  MapPublisher publisher_;
  std::optional<WarehouseMemory> memory_;
  std::uint64_t next_ = 0;
  StampNs stamp_ns_ = 0;
  std::vector<ObjectEvent> events_;
};

/// Every row of the pieces, as they are in the file.
std::vector<std::string> stored_pieces(const std::filesystem::path& folder);

}  // namespace pocd::test

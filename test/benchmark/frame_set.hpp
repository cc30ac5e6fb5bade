// The frames that everything is measured on.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pocd/pipeline/pipeline_config.hpp"
#include "pocd/sim/scenario.hpp"

namespace pocd::bench {

struct FrameSet {
  std::string name;
  PipelineConfig config;
  std::vector<Frame> frames;  ///< empty: not there, `missing` says what
  std::string missing;
  std::optional<Scenario> scenario;  ///< of simulated frames: the truth
  /// What really stands there, by frame; empty where nobody knows.
  std::vector<std::vector<OrientedBox>> objects;
};

/// Folder of the recordings: POCD_TEST_DATA in the environment, or as configured.
std::string data_folder();

/// All of redkitchen (640 x 480), at most `limit` frames.
FrameSet load_redkitchen(std::size_t limit);
/// The still states of tabletop_states, each `repeat` times.
FrameSet load_tabletop(std::size_t limit);
/// One lap of the TorWIC circuit (640 x 360) through the simulator's stereo camera.
FrameSet load_circuit(std::size_t limit);
/// The same with exact depth, labels and poses: what is wrong with a map of it is the mapper's.
FrameSet load_exact_circuit(std::size_t limit);

/// Which object owns what a frame shows, as a tracker would say: things of half a metre, a third of
/// them objects, that keep their owner from frame to frame; one entry per 2 x 2 pixels.
std::vector<std::uint32_t> made_up_owners(const Frame& frame);
constexpr int kOwnerStride = 2;

}  // namespace pocd::bench

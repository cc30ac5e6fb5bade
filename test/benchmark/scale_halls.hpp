// A place as large as wanted: the same simulated hall, mapped over and over at other places.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pocd/map/map_delta.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace pocd::benchmark {

/// A hall has a floor of 12.8 m x 8 m = 102.4 m2 and ten boxes. The camera sees nothing beyond the
/// floor, and halls lie 6.4 m apart, so that all halls of a map are alike, and alike in every map.
constexpr double kHallArea_m2 = 12.8 * 8.0;

/// The configuration of the runs: defaults but for the classes and the reach of 4 m.
PipelineConfig scale_config();

/// Frames of one drive through the hall at the origin, with noise; `step_m` apart.
std::vector<Frame> drive_through_hall(double step_m, std::uint64_t seed);

/// A pipeline with a publication behind it, as in a node, that has mapped `halls` halls.
class Site {
 public:
  Site(const PipelineConfig& config, int halls, const std::vector<Frame>& drive);

  /// The frame in the first hall.
  FrameResult process(const Frame& frame);
  std::size_t publish();

  int halls() const { return halls_; }
  /// Where the n-th one lies, the first at the origin; whole tiles of the map away.
  Eigen::Vector2d place_m(int hall) const;
  const PocdPipeline& pipeline() const { return *pipeline_; }
  PocdPipeline& pipeline() { return *pipeline_; }
  const MapPublisher& publisher() const { return publisher_; }
  /// Heap that pipeline and publication took to build [bytes]. Whoever gives memory back that the
  /// other has asked for has less: below zero, even, but the sum is right.
  std::int64_t pipeline_heap() const { return pipeline_heap_; }
  std::int64_t publisher_heap() const { return publisher_heap_; }

 private:
  void process_at(Frame frame, const Eigen::Vector2d& at_m, const std::string& robot);

  int halls_;
  std::unique_ptr<PocdPipeline> pipeline_;
  MapPublisher publisher_;
  StampNs stamp_ns_ = 0;
  std::uint64_t sequence_ = 0;
  std::int64_t pipeline_heap_ = 0, publisher_heap_ = 0;
};

}  // namespace pocd::benchmark

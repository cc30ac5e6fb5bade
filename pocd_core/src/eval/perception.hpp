// The pipeline's own way from a frame to observations, for the baselines that need detections: what
// they are compared by is the map keeping, not the segmentation.
#pragma once

#include "pocd/pipeline/pipeline_config.hpp"
#include "pocd/segmentation/observations.hpp"

namespace pocd {

class Perception {
 public:
  explicit Perception(const PipelineConfig& config)
      : config_(config), classes_(config.classes), pool_(1) {}

  /// Observations of the frame; their pixels are in cloud() until the next call.
  const Observations& observe(const Frame& frame);
  const OrganizedCloud& cloud() const { return cloud_; }

  /// CV_8UC1 of the frame's size from one value per grid pixel.
  cv::Mat full_size_mask(const Frame& frame, const std::vector<std::uint8_t>& of_grid) const;

 private:
  PipelineConfig config_;
  ClassTable classes_;
  ThreadPool pool_;
  GroundModel ground_;
  OrganizedCloud cloud_;
  PlaneSegmentation planes_;
  Observations observations_;
};

}  // namespace pocd

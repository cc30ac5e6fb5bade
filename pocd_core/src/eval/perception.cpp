#include "perception.hpp"

#include <algorithm>

namespace pocd {

const Observations& Perception::observe(const Frame& frame) {
  const SegmentationConfig& segmentation = config_.segmentation;
  organize(frame, segmentation.stride, config_.map.max_depth_m, config_.classes, classes_, pool_,
           cloud_);
  segment_planes(cloud_, segmentation, config_.depth_noise, planes_);
  vote_planes(planes_, segmentation.majority_share, cloud_);
  ground_.update(planes_, segmentation, config_.depth_noise, cloud_);
  extract_observations(segmentation, config_.depth_noise, config_.map.voxel_size_m, planes_, cloud_,
                       observations_);
  return observations_;
}

cv::Mat Perception::full_size_mask(const Frame& frame,
                                   const std::vector<std::uint8_t>& of_grid) const {
  cv::Mat mask(frame.camera.height, frame.camera.width, CV_8UC1);
  for (int v = 0; v < mask.rows; ++v) {
    std::uint8_t* row = mask.ptr<std::uint8_t>(v);
    const int grid_row = std::min(v / cloud_.stride, cloud_.height - 1);
    for (int u = 0; u < mask.cols; ++u) {
      const int grid_col = std::min(u / cloud_.stride, cloud_.width - 1);
      row[u] = of_grid[static_cast<std::size_t>(grid_row * cloud_.width + grid_col)];
    }
  }
  return mask;
}

}  // namespace pocd

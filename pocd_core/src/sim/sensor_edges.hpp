// What happens at the borders of things in an image, whatever made the image.
#pragma once

#include <opencv2/core/mat.hpp>

#include "pocd/sim/sensor_model.hpp"

namespace pocd {

/// CV_8UC1: 1 for pixels within `reach` [px] of a depth edge on its far side, along a row or a
/// column. Depth 0 is behind everything.
cv::Mat far_side_of_edges(const cv::Mat& depth_m, int reach);

/// A window of a stereo match that lies over an edge takes the nearer surface: things grow by up to
/// model.fattening_px, by how much changes along the edge and from frame to frame.
void fatten_edges(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m);

/// Depths between the two sides of an edge, in the air: a mean of both sides' disparities with a
/// uniform weight, for model.flying_share of the pixels within model.flying_px of the edge on its
/// far side. Nothing is added in front of pixels without depth.
void add_flying_pixels(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m);

/// Cells without return; their share grows with the square of the range to model.range_hole_share at
/// model.max_range_m.
void punch_range_holes(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m);

/// The mask is made at a resolution lower by model.label_stride_px.
void coarsen_masks(const SensorModel& model, cv::Mat& labels);

/// Every label grows or shrinks by up to model.label_bleed_px as a whole, slowly over frames: the
/// network sees one thing's border too far out and its neighbour's too far in.
void bleed_masks(const SensorModel& model, const NoiseKey& key, cv::Mat& labels);

}  // namespace pocd

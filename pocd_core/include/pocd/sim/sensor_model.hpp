// What a stereo depth camera, a segmentation network and a localisation make of an exact frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pocd/common/describe.hpp"
#include "pocd/input/frame.hpp"

namespace pocd {

/// Sensors that have a name.
enum class SensorKind {
  kPerfect,  ///< SensorModel::perfect()
  kStereo,   ///< the defaults of SensorModel
};
inline EnumWords<SensorKind> words_of(SensorKind) {
  return {{SensorKind::kPerfect, "perfect"}, {SensorKind::kStereo, "stereo"}};
}

/// Works on images alone, whatever made them. Every effect can be switched off by its own field
/// (0), and those of borders and far ranges are off unless asked for. The same seed and frame
/// number give the same errors, whatever was rendered before.
struct SensorModel {
  double depth_base_m = 0.002;
  double depth_quadratic_per_m = 0.0025;
  double correlated_share = 0.5;
  double correlated_cell_px = 24.0;
  double random_hole_share = 0.01;
  double hole_blobs_per_frame = 3.0;
  double edge_hole_px = 2.0;
  double edge_hole_probability = 0.6;
  double fattening_px = 0.0;
  double flying_px = 0.0;
  double flying_share = 0.0;
  double range_hole_share = 0.0;
  double quantum_m = 0.001;
  double min_range_m = 0.25;
  double max_range_m = 8.0;
  double label_border_px = 2.0;
  double label_bleed_px = 0.0;
  int label_stride_px = 1;
  double label_blobs_per_frame = 1.0;
  double label_blob_radius_px = 12.0;
  std::string label_blob_classes = "0,4,5,6,7,8,9,12";
  double alias_share = 0.15;
  int alias_episode_frames = 8;
  int alias_class_a = 4;
  int alias_class_b = 5;
  double position_error_m = 0.025;
  double rotation_error_deg = 0.3;
  double pose_error_period_s = 8.0;
  double color_noise = 4.0;

  /// Throws InputError for a list that is empty or holds anything but classes.
  std::vector<int> blob_classes() const;

  /// Exact depth, labels and poses; no range limit.
  static SensorModel perfect();
  static SensorModel of(SensorKind kind) {
    return kind == SensorKind::kPerfect ? perfect() : SensorModel();
  }

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("depth_base_m", depth_base_m, Range{0.0, 0.2},
          "Depth noise at zero range, one sigma [m]: sigma(z) = base + quadratic z^2.");
    visit("depth_quadratic_per_m", depth_quadratic_per_m, Range{0.0, 0.1},
          "Growth of the depth noise with the square of the range, one sigma [1/m].");
    visit("correlated_share", correlated_share, Range{0.0, 1.0},
          "Share of the noise variance that neighbouring pixels and frames have in common.");
    visit("correlated_cell_px", correlated_cell_px, Range{4.0, 256.0},
          "Grid spacing of the correlated noise [px].");
    visit("random_hole_share", random_hole_share, Range{0.0, 1.0},
          "Share of pixels without a return, one by one.");
    visit("hole_blobs_per_frame", hole_blobs_per_frame, Range{0.0, 100.0},
          "Mean number of round holes per frame.");
    visit("edge_hole_px", edge_hole_px, Range{0.0, 10.0},
          "Pixels this near to a depth edge, on its far side, lose their return [px].");
    visit("edge_hole_probability", edge_hole_probability, Range{0.0, 1.0},
          "Probability that such a pixel has no return.");
    visit("fattening_px", fattening_px, Range{0.0, 10.0},
          "Things grow by up to this at depth edges: a stereo window takes the nearer side [px].");
    visit("flying_px", flying_px, Range{0.0, 10.0},
          "Pixels this near to a depth edge, on its far side, may fly between its sides [px].");
    visit("flying_share", flying_share, Range{0.0, 1.0}, "Share of these pixels that do.");
    visit("range_hole_share", range_hole_share, Range{0.0, 1.0},
          "Share of cells without a return at max_range_m; grows with the square of the range.");
    visit("quantum_m", quantum_m, Range{0.0, 0.1},
          "Depth is rounded to multiples of this [m]; 0: not.");
    visit("min_range_m", min_range_m, Range{0.0, 5.0}, "No return below this depth [m].");
    visit("max_range_m", max_range_m, Range{0.1, 1000.0}, "No return above this depth [m].");
    visit("label_border_px", label_border_px, Range{0.0, 20.0},
          "Amplitude of the raggedness of mask borders [px].");
    visit("label_bleed_px", label_bleed_px, Range{0.0, 20.0},
          "A whole mask reaches up to this far into its neighbour's, changing slowly [px].");
    visit("label_stride_px", label_stride_px, Range{1, 64},
          "Masks are made at a resolution lower by this factor [px].");
    visit("label_blobs_per_frame", label_blobs_per_frame, Range{0.0, 100.0},
          "Mean number of round blobs of a wrong class per frame.");
    visit("label_blob_radius_px", label_blob_radius_px, Range{0.0, 200.0},
          "Largest radius of such a blob [px].");
    visit("label_blob_classes", label_blob_classes,
          "Classes that such a blob may have, separated by commas.");
    visit("alias_share", alias_share, Range{0.0, 1.0},
          "Share of frames in which class a is labelled as class b throughout.");
    visit("alias_episode_frames", alias_episode_frames, Range{1, 1000},
          "Frames of one robot for which aliasing stays as it is.");
    visit("alias_class_a", alias_class_a, Range{0, 65535}, "Class a of the aliasing.");
    visit("alias_class_b", alias_class_b, Range{0, 65535}, "Class b of the aliasing.");
    visit(
        "position_error_m", position_error_m, Range{0.0, 1.0},
        "Amplitude of the slowly varying error of the position, per axis; a third of it in z [m].");
    visit("rotation_error_deg", rotation_error_deg, Range{0.0, 20.0},
          "Amplitude of the slowly varying error of the heading; a third of it in roll, pitch "
          "[deg].");
    visit("pose_error_period_s", pose_error_period_s, Range{0.1, 1000.0},
          "Time in which the pose error changes to an independent one [s].");
    visit("color_noise", color_noise, Range{0.0, 100.0},
          "Noise of the colour image, one sigma [0-255].");
  }
};

/// Number of a frame within its robot's sequence, and the seed: what the errors depend on.
struct NoiseKey {
  std::uint64_t seed = 1;
  std::uint64_t robot = 0;
  std::uint64_t frame = 0;
};

/// Degrades depth (CV_32FC1 [m]) in place: noise, holes, range limits, quantisation.
void degrade_depth(const SensorModel& model, const NoiseKey& key, cv::Mat& depth_m);

/// Degrades labels (CV_16UC1 class * label_divisor + instance) in place.
void degrade_labels(const SensorModel& model, const NoiseKey& key, int label_divisor,
                    cv::Mat& labels);

/// Adds noise to a BGR image in place.
void degrade_color(const SensorModel& model, const NoiseKey& key, cv::Mat& color);

/// True camera pose to the one the localisation reports at time_s. The error is a rotation about
/// the camera's position and a shift, both bounded by their amplitudes.
Pose degrade_pose(const SensorModel& model, const NoiseKey& key, double time_s, const Pose& T_W_C);

}  // namespace pocd

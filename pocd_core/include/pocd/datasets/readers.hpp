// The readers one by one, for callers that know what they have; others use open_dataset.
#pragma once

#include <memory>

#include "pocd/datasets/open_dataset.hpp"

namespace pocd {

/// Folders in the layout of 7-Scenes: frame-NNNNNN.depth.png (uint16 mm; 0 and 65535 invalid),
/// frame-NNNNNN.pose.txt (4x4 camera-to-world, m), frame-NNNNNN.color.jpg or .color.png (optional),
/// camera-intrinsics.txt (3x3, once per folder), gravity.txt (optional, see DatasetOptions). Frame
/// n of the listing has the stamp n / frame_rate.
std::unique_ptr<DatasetReader> open_rgbd(const DatasetOptions& options);

/// Folders of labelled organised PCD files, one per still state, in the order of their names.
/// Fields x y z (float, metres, camera optical frame), label (uint32, optional), rgb or rgba
/// (optional). Label 0 is invalid -> class 0 and no depth; 1 to 9 -> class 1 (table); tens digits
/// -> class 2 (object) with instance = label / 10. Needs options.camera and options.T_W_C.
std::unique_ptr<DatasetReader> open_pcd(const DatasetOptions& options);

/// Folders in the layout of TorWIC mapping: RGB/, Depth/, Segmentation/ with 0000.png or 0.png ...,
/// poses.txt with `id sec nsec px py pz qx qy qz qw` of base_link. RGB and Segmentation may be
/// absent. Intrinsics and mount: options, or TorWIC's (method.md).
std::unique_ptr<DatasetReader> open_torwic(const DatasetOptions& options);

/// Folders in the layout of Co-Fusion's synthetic sequences (Runz and Agapito, ICRA 2017), of which
/// one shows ToyCar: calibration.txt (fx fy cx cy width height), depth_noise/ or depth_original/
/// DepthNNNN.exr (metres; or 16-bit PNG, mm), trajectories/gt-cam-0.txt with `number tx ty tz qx qy
/// qz qw` of the camera in the world, mask_id/MaskNNNN.png (ids as labels, optional),
/// colour/ColorNNNN.png (optional), gravity.txt (ours, optional). No stamps: frame n of the listing
/// has n / frame_rate. What of this is known from where: docs/evaluation.md.
std::unique_ptr<DatasetReader> open_toycar(const DatasetOptions& options);

/// Recordings of the bus: MCAP files, rosbag2 .db3 files, or folders of them. Frames come in the
/// order of their stamps; an input that begins before the one before it ended is moved behind it.
std::unique_ptr<DatasetReader> open_recorded(const DatasetOptions& options);

}  // namespace pocd

// The camera of the TorWIC data set's robot, which the simulator's robots have too.
#pragma once

#include "pocd/input/dataset_reader.hpp"

namespace pocd {

/// Camera and mount of TorWIC's front camera (method.md): 640x360, pitched up by 15 degrees. The
/// base frame is put 0.4 m above the floor, so the lens is at 0.41 m and sees a 2 m stack, 0.7 m to
/// its side, from 1 m ahead on.
CameraModel torwic_camera();
CameraExtrinsics torwic_extrinsics();

}  // namespace pocd

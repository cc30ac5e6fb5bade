// Truth of a data set that shows one table in several states: which things stand where in each
// state.
#pragma once

#include <vector>

#include "pocd/common/describe.hpp"
#include "pocd/datasets/open_dataset.hpp"

namespace pocd {

struct TruthVector {
  double x = 0.0, y = 0.0, z = 0.0;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit("x", x, Range{-1e4, 1e4}, "x [m].");
    visit("y", y, Range{-1e4, 1e4}, "y [m].");
    visit("z", z, Range{-1e4, 1e4}, "z [m].");
  }
};

struct TruthRotation {
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
  template <class Visitor>
  void describe(Visitor& visit) {
    const Range unit{-1.0, 1.0};
    visit("x", x, unit, "Quaternion x.");
    visit("y", y, unit, "Quaternion y.");
    visit("z", z, unit, "Quaternion z.");
    visit("w", w, unit, "Quaternion w.");
  }
};

struct TruthCameraPose {
  TruthVector translation;
  TruthRotation rotation;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit.group("translation", translation, "Camera centre in the map frame.");
    visit.group("rotation", rotation, "Camera optical frame in the map frame.");
  }
};

struct TruthCamera {
  CameraModel model;
  template <class Visitor>
  void describe(Visitor& visit) {
    const Range pixels{1, kLargestSide_px};
    visit("width", model.width, pixels, "[px].");
    visit("height", model.height, pixels, "[px].");
    visit("fx", model.fx, pixels, "[px].");
    visit("fy", model.fy, pixels, "[px].");
    visit("cx", model.cx, pixels, "[px].");
    visit("cy", model.cy, pixels, "[px].");
  }
};

struct TruthThing {
  int state = 0;
  double x = 0.0, y = 0.0, z = 0.0;
  Eigen::Vector3d center_W() const { return {x, y, z}; }
  template <class Visitor>
  void describe(Visitor& visit) {
    visit("state", state, Range{0, 1000000}, "Number of the still image.");
    visit("x", x, Range{-1e4, 1e4}, "Centre of the visible surface [m].");
    visit("y", y, Range{-1e4, 1e4}, "Centre of the visible surface [m].");
    visit("z", z, Range{-1e4, 1e4}, "Centre of the visible surface [m].");
  }
};

/// Read with load_config, e.g. test/data/tabletop_truth.yaml.
struct StateTruth {
  TruthCamera camera;
  TruthCameraPose camera_pose;
  double tolerance_m = 0.05;
  int frames_per_state = 10;
  std::vector<TruthThing> objects;

  Pose T_W_C() const;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.group("camera", camera, "Intrinsics.");
    visit.group("camera_pose", camera_pose, "Fixed pose of the camera.");
    visit("tolerance_m", tolerance_m, Range{0.0, 10.0},
          "Largest distance between two centres [m].");
    visit("frames_per_state", frames_per_state, Range{1, 10000}, "How often each image is shown.");
    visit("objects", objects, "What stands where.");
  }
};

/// One thing of one state, with what its labelled pixels say.
struct ExpectedObject {
  Eigen::Vector3d listed_W = Eigen::Vector3d::Zero();  ///< centre of the visible surface
  OrientedBox box;                                     ///< around its labelled points
  Points points_W;                                     ///< labelled points
  /// Other centres at which the thing may be held: those of earlier states, seen less hidden.
  std::vector<Eigen::Vector3d> earlier_W;
};

struct ExpectedState {
  int state = 0;
  std::vector<ExpectedObject> objects;
  /// Things of earlier states that nothing has contradicted since and that are hidden now: the
  /// library may or may not hold them.
  std::vector<ExpectedObject> hidden;
};

/// Expectations of every state of the folder, from `truth` and the labels of its images. Throws
/// InputError when labels and truth disagree by more than 1 cm or in number.
std::vector<ExpectedState> expected_states(const StateTruth& truth,
                                           const std::filesystem::path& folder);

/// Options that show each state `frames_per_state` times.
DatasetOptions state_dataset(const StateTruth& truth, const std::filesystem::path& folder);

}  // namespace pocd

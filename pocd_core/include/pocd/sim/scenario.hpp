// A simulated run: a building, robots that drive through it, and visits between which things
// change.
#pragma once

#include <string>
#include <vector>

#include "pocd/input/torwic_camera.hpp"
#include "pocd/sim/robot_path.hpp"
#include "pocd/sim/scene.hpp"
#include "pocd/sim/sensor_model.hpp"

namespace pocd {

struct SimRobot {
  std::string name;  ///< becomes Frame::robot
  PathSpec path;
};

/// One drive of every robot along its path. Objects are those at the start of the visit.
struct SimVisit {
  std::string name;
  std::vector<SceneObject> objects;
};

/// World frame: z up, floor at z = 0.
struct Scenario {
  std::string name;
  std::string description;
  CameraModel camera;
  CameraExtrinsics extrinsics;  ///< T_B_C of every robot
  double base_height_m = 0.4;   ///< of the robots' base frame above the floor
  double frame_rate_hz = 15.0;
  double visit_gap_s = 1.0;  ///< time between the last frame of a visit and the first of the next
  Eigen::Vector2d area_low_m = {-6.5, -6.5}, area_high_m = {6.5, 6.5};  ///< inside of the walls
  std::vector<SceneObject> fixtures;
  std::vector<SimRobot> robots;
  SensorModel sensor;
  std::vector<SimVisit> visits;
};

/// Floor slab and four walls around the area, as fixtures.
std::vector<SceneObject> make_building(const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m,
                                       double wall_height_m, ClassId floor_class,
                                       ClassId wall_class);

/// Visits of several scenarios one after the other. Robots, camera and building are the first
/// one's; throws InputError, naming the scenario, when another has a different camera, mount, frame
/// rate or set of robots.
Scenario concatenate(const std::vector<Scenario>& scenarios);

/// Everything there at time_s after the start of a visit: fixtures first, then objects.
Scene scene_at(const Scenario& scenario, std::size_t visit, double time_s);

/// Throws InputError naming `scenario.name` and the field: no visit, no robot, repeated names of
/// objects or robots, an object without parts or outside the area, a camera or path that is not
/// valid.
void validate(const Scenario& scenario);

}  // namespace pocd

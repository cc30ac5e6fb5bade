// Scenarios as YAML files. Part of the configuration library (pocd::config), not of the core.
//
//   name: "1-1"                     # required
//   description: text
//   base: 0.yaml                    # beside this file: everything of it holds unless given here;
//                                   # its objects are as at the end of its last visit
//   camera: {width, height, fx, fy, cx, cy}                      # default: TorWIC's
//   mount: {translation: [x, y, z], quaternion_xyzw: [...]}      # camera optical frame in base
//          or {translation: [x, y, z], yaw_deg: 0, pitch_deg: 15}         # pitch up is positive
//   base_height_m, frame_rate_hz, visit_gap_s
//   area: {low: [x, y], high: [x, y], wall_height_m: 4, floor_class: 1, wall_class: 0}
//   sensor: perfect                 # or stereo, a file of SensorModel's fields, or a map of them;
//                                   # what is not given is as in stereo
//   robots: [{name: r1, path: {waypoints: [[x, y], ...], closed: true, speed_m_s: 0.8,
//             turn_rate_deg_s: 69, corner_radius_m: 0, start_m: 0, laps: 1}}]
//   kinds: {stack: {class: 7, ...}} # fields shared by objects that say `kind: stack`
//   objects: [{name, kind, class, stationarity: 0, at: [x, y, yaw_deg], z: 0, lean_deg: 0,
//              size: [x, y, z], shape: box, rgb: [r, g, b], texture: plain,    # one part, or:
//              parts: [{shape, size, at: [x, y, z], yaw_deg, rgb, texture}]}]  # at: middle of base
//              # instead of shape and size: mesh: FILE.obj, scale: 1 (z up, metres)
//   changes: [...]                  # of the only visit, or
//   visits: [{name, changes: [...]}]                             # each follows from the one before
// Files are named relative to the scenario or one of its bases.
// A change is one of
//   {move: NAME or [NAMES], by: [dx, dy, dyaw_deg]}    {move: NAME, to: [x, y, yaw_deg]}
//   {remove: NAME or [NAMES]}                          {add: OBJECT}
//   {drive: NAME, track: [[time_s, x, y, yaw_deg], ...]}   moves and stays at the end
//   {pass: OBJECT, track: [...]}                       is there only while its track lasts
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pocd/sim/scenario.hpp"

namespace pocd {

/// Throws InputError naming file, place and key for anything unknown, missing, of the wrong type or
/// that validate(Scenario) refuses.
Scenario load_scenario(const std::filesystem::path& file);

/// A file of SensorModel's fields; those that it does not have are as of a stereo camera. Throws
/// InputError naming file and key.
SensorModel load_sensor(const std::filesystem::path& file);

/// The scenarios one after the other as one run.
Scenario load_run(const std::vector<std::filesystem::path>& files);

}  // namespace pocd

// Makes two laps through a place of random layout, between which things are removed, moved by 0.3
// to 1.5 m and added, in the layout of TorWIC, with the truth of the second lap:
//   pocd_changed_scene KIND SEED OUTPUT_DIR [MESH_DIR]
// KIND: circuit (boxes and fences, a camera that swings to one side) or warehouse (racks, pallets,
// bins and jacks of the meshes in MESH_DIR, a camera that swings to both). A seed gives the same
// scene every time; odd seeds have the noise of edges, too: fattened and flying pixels, coarse
// masks that bleed. changed_scenes.py makes, runs and scores any number of them.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>

#include "pocd/common/check.hpp"
#include "pocd/common/random.hpp"
#include "pocd/datasets/torwic_writer.hpp"
#include "pocd/sim/render.hpp"
#include "pocd/sim/scenario.hpp"
#include "pocd/sim/triangle_mesh.hpp"

namespace {

using namespace pocd;  // NOLINT

// Classes of config/torwic.yaml.
constexpr ClassId kFloor = 1, kFence = 5, kRack = 6, kBox = 7, kMachine = 8, kJack = 9, kBin = 12;
constexpr double kMaxDepth_m = 3.0;
/// A thing is seen when every fourth frame at a quarter of the resolution has so many pixels of it.
constexpr int kSeenPixels = 120;
/// Like things that change are no nearer than this: else the truth is which of them is which.
constexpr double kTellApart_m = 2.2;

struct Kind {
  ClassId class_id = 0;
  std::shared_ptr<const TriangleMesh> mesh;  ///< or null: a box
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();  ///< of its frame
  Eigen::Vector3d size() const { return high - low; }
};

struct Thing {
  std::string name, kind;
  double x = 0.0, y = 0.0, yaw = 0.0;
  bool moves = true;  ///< false: a rack, which stays
};
using Things = std::vector<Thing>;

struct Eye {
  double x, y, yaw;
};

/// What differs between a circuit and a warehouse.
struct Style {
  int frames;
  double rate_hz, step_m, base_height_m;
  int removed, moved, added;
  std::vector<std::string> new_kinds;
  Eigen::Vector2d new_reach_m;
  double new_turn_rad;
};

class SceneMaker {
 public:
  SceneMaker(bool warehouse, std::uint64_t seed, const std::filesystem::path& meshes)
      : warehouse_(warehouse), seed_(seed), random_(2 * seed + (warehouse ? 1 : 0)) {
    camera_ = {320, 180, 230.54780578613281, 230.45909118652344, 162.7390213, 88.78831482};
    T_B_C_ = torwic_extrinsics().T_B_C;
    if (warehouse_) {
      for (const char* name : {"ClutteringA", "ClutteringC", "ClutteringD"})
        add_mesh(name, kBox, meshes);
      add_mesh("Bucket", kBin, meshes);
      add_mesh("TrashCanC", kBin, meshes);
      add_mesh("PalletJackB", kJack, meshes);
      add_mesh("DeskC", kMachine, meshes);
      add_mesh("ShelfD", kRack, meshes);
      add_mesh("ShelfE", kRack, meshes);
      style_ = {260, 10.0, 0.118, 0.35, 3, 4, 3, movable_meshes(), {4.5, 7.5}, 0.6};
      furnish_warehouse();
    } else {
      add_box("long", kBox, {0.99, 0.49, 2.0});
      add_box("wide", kBox, {0.49, 0.99, 2.0});
      add_box("large", kBox, {0.99, 0.99, 2.0});
      add_box("low", kBox, {0.49, 0.49, 1.1});
      add_box("fence1", kFence, {1.5, 0.05, 3.0});
      add_box("fence2", kFence, {1.2, 0.05, 3.0});
      add_box("fence3", kFence, {1.8, 0.05, 3.0});
      style_ = {240, 15.0, 0.0788, 0.2, 4, 3, 2, {"wide", "long", "low", "low"}, {3.6, 3.6}, 0.3};
      furnish_circuit();
    }
    change();
  }

  void write(const std::filesystem::path& output) const {
    std::filesystem::create_directories(output);
    std::map<std::string, int> first_seen;  // frame of the second lap
    const SensorModel sensor = sensor_model();
    for (int lap = 0; lap < 2; ++lap) {
      const Things& things = lap == 0 ? before_ : after_;
      const Scene scene = scene_of(things);
      TorwicWriter writer(output / ("lap_" + std::to_string(lap)), T_B_C_);
      for (int i = 0; i < style_.frames; ++i) {
        const Pose T_W_C = camera_pose(paths_[lap][static_cast<std::size_t>(i)]);
        RenderedFrame picture = render(scene, camera_, T_W_C, false);
        if (lap == 1) note_first_seen(picture, i, things, first_seen);
        const NoiseKey key{seed_, 0, static_cast<std::uint64_t>(lap * style_.frames + i)};
        degrade_depth(sensor, key, picture.depth_m);
        degrade_labels(sensor, key, 1, picture.labels);
        Frame frame;
        frame.stamp_ns = 1'000'000'000'000 + static_cast<StampNs>(i * 1e9 / style_.rate_hz);
        frame.camera = camera_;
        frame.depth_m = picture.depth_m;
        frame.labels = picture.labels;
        frame.T_W_C = degrade_pose(sensor, key, 100.0 * lap + i / style_.rate_hz, T_W_C);
        writer.write(frame);
      }
    }
    write_truth(output / "truth_objects.txt", first_seen);
  }

 private:
  static std::vector<std::string> movable_meshes() {
    return {"ClutteringA", "ClutteringC", "ClutteringD", "Bucket", "TrashCanC", "PalletJackB"};
  }

  void add_mesh(const std::string& name, ClassId class_id, const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / (name + ".obj");
    // The loader shifts the middle to the origin; truth and floor are in the file's own frame.
    Kind kind{class_id, load_obj(file), Eigen::Vector3d::Constant(1e9), {}};
    kind.high = -kind.low;
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
      Eigen::Vector3d p;
      if (std::sscanf(line.c_str(), "v %lf %lf %lf", &p.x(), &p.y(), &p.z()) != 3) continue;
      kind.low = kind.low.cwiseMin(p);
      kind.high = kind.high.cwiseMax(p);
    }
    kinds_[name] = kind;
  }
  void add_box(const std::string& name, ClassId class_id, const Eigen::Vector3d& size_m) {
    kinds_[name] = {class_id,
                    nullptr,
                    {-size_m.x() / 2, -size_m.y() / 2, 0.0},
                    {size_m.x() / 2, size_m.y() / 2, size_m.z()}};
  }
  const std::string& one_of(const std::vector<std::string>& names) {
    return names[random_.below(names.size())];
  }

  SceneObject object_of(const Thing& thing) const {
    const Kind& kind = kinds_.at(thing.kind);
    SceneObject object;
    object.name = thing.name;
    object.class_id = kind.class_id;
    object.T_W_O = upright_pose({thing.x, thing.y, 0.0}, thing.yaw);
    ScenePart part;
    part.shape = kind.mesh ? Shape::kMesh : Shape::kBox;
    part.mesh = kind.mesh;
    part.size_m = kind.mesh ? kind.mesh->size_m() : kind.size();
    part.T_O_P.translation() = 0.5 * (kind.low + kind.high);
    object.parts.push_back(part);
    return object;
  }
  OrientedBox box_of(const Thing& thing, double grown_m) const {
    OrientedBox box = bounding_box(object_of(thing));
    box.size_m.head<2>().array() += 2.0 * grown_m;
    return box;
  }
  Scene scene_of(const Things& things) const {
    Scene scene;
    scene.objects = building_;
    for (const Thing& thing : things) scene.objects.push_back(object_of(thing));
    return scene;
  }
  Pose camera_pose(const Eye& eye) const {
    return Pose(upright_pose({eye.x, eye.y, style_.base_height_m}, eye.yaw)) * T_B_C_;
  }

  /// No other thing is nearer than `gap_m`.
  bool has_room(const Thing& thing, const Things& others, double gap_m) const {
    return std::none_of(others.begin(), others.end(), [&](const Thing& other) {
      return other.name != thing.name &&
             boxes_overlap(box_of(thing, gap_m / 2), box_of(other, gap_m / 2));
    });
  }
  bool is_off_the_path(const Thing& thing, double gap_m) const {
    const OrientedBox box = box_of(thing, gap_m);
    const Eigen::Rotation2Dd turn(-box.pose.yaw_rad);
    for (const auto& path : paths_) {
      for (const Eye& eye : path) {
        const Eigen::Vector2d at =
            turn * (Eigen::Vector2d(eye.x, eye.y) - box.pose.position_W.head<2>());
        if ((at.cwiseAbs() - 0.5 * box.size_m.head<2>()).maxCoeff() < 0.0) return false;
      }
    }
    return true;
  }

  /// Along a rectangle, with a camera that swings.
  std::vector<Eye> path(double width_m, double height_m, bool counterclockwise, double swing_rad,
                        double period, double phase) const {
    std::vector<Eigen::Vector2d> corners = {{width_m / 2, -height_m / 2},
                                            {width_m / 2, height_m / 2},
                                            {-width_m / 2, height_m / 2},
                                            {-width_m / 2, -height_m / 2}};
    if (!counterclockwise) std::reverse(corners.begin(), corners.end());
    const double turn_rad = 0.12 * style_.step_m / 0.08;
    std::vector<Eye> out;
    double heading = 0.0;
    for (int i = 0; i < style_.frames; ++i) {
      double way_m = std::fmod(0.15 * height_m + i * style_.step_m, 2.0 * (width_m + height_m));
      std::size_t edge = 0;
      const auto along = [&] { return Eigen::Vector2d(corners[(edge + 1) % 4] - corners[edge]); };
      for (; way_m > along().norm(); edge = (edge + 1) % 4) way_m -= along().norm();
      const Eigen::Vector2d direction = along().normalized();
      const Eigen::Vector2d p = corners[edge] + way_m * direction;
      const double target = std::atan2(direction.y(), direction.x());
      if (i == 0) heading = target;
      heading += std::clamp(std::remainder(target - heading, 2.0 * M_PI), -turn_rad, turn_rad);
      out.push_back({p.x(), p.y(), heading});
    }
    // A turn begins and ends within some frames; the camera swings on top of it.
    constexpr int kSmooth = 4;
    const std::vector<Eye> sharp = out;
    for (int i = 0; i < style_.frames; ++i) {
      double sum = 0.0;
      for (int k = -kSmooth; k <= kSmooth; ++k)
        sum += sharp[static_cast<std::size_t>(std::clamp(i + k, 0, style_.frames - 1))].yaw;
      const double at = 2.0 * M_PI * i / period;
      const double swing = warehouse_ ? std::sin(at + phase) : 0.5 * (1.0 - std::cos(at));
      out[static_cast<std::size_t>(i)].yaw = sum / (2 * kSmooth + 1) + swing_rad * swing;
    }
    return out;
  }

  void furnish_warehouse() {
    const double width = random_.uniform(4.0, 5.4), height = random_.uniform(9.5, 12.0);
    const bool counterclockwise = random_.uniform() < 0.5;
    const double swing_rad = random_.uniform(0.5, 0.85), period = random_.uniform(35.0, 60.0);
    for (auto& lap : paths_) {
      lap = path(width, height, counterclockwise, swing_rad, period,
                 random_.uniform(0.0, 2.0 * M_PI));
    }
    const Eigen::Vector2d half(width / 2 + 4.0, height / 2 + 4.0);
    building_ = make_building(-half, half, 4.0, kFloor, kMachine);
    const auto fill = [&](int count, const std::string& prefix,
                          const std::vector<std::string>& kinds, double beyond_m, bool moves,
                          double off_m, double gap_m) {
      for (int placed = 0, tries = 0; placed < count && tries < 800; ++tries) {
        Thing thing;
        thing.name = prefix + std::to_string(placed);
        thing.kind = one_of(kinds);
        thing.x = random_.uniform(-width / 2 - beyond_m, width / 2 + beyond_m);
        thing.y = random_.uniform(-height / 2 - beyond_m, height / 2 + beyond_m);
        thing.yaw = moves ? random_.uniform(-M_PI / 2, M_PI / 2)
                          : static_cast<double>(random_.below(4)) * M_PI / 2;
        thing.moves = moves;
        if (!is_off_the_path(thing, off_m) || !has_room(thing, before_, gap_m)) continue;
        before_.push_back(thing);
        ++placed;
      }
    };
    fill(4, "rack_", {"ShelfD", "ShelfE", "DeskC"}, 2.4, false, 0.7, 0.3);
    fill(12, "thing_", movable_meshes(), 1.9, true, 0.5, 0.25);
  }

  void furnish_circuit() {
    const double width = random_.uniform(4.7, 5.3), height = random_.uniform(4.7, 5.3);
    const bool counterclockwise = random_.uniform() < 0.5;
    const double swing_rad = random_.uniform(-0.3, 0.3);
    for (auto& lap : paths_)
      lap = path(width, height, counterclockwise, swing_rad, style_.frames / 4.0, 0.0);
    const Eigen::Vector2d half(width / 2 + 3.5, height / 2 + 3.5);
    building_ = make_building(-half, half, 4.0, kFloor, 0);
    int number = 0;
    const auto put = [&](const std::string& kind, double x, double y, double yaw) {
      Thing thing;
      thing.name = kind + "_" + std::to_string(number++);
      thing.kind = kind;
      thing.x = x + random_.uniform(-0.15, 0.15);
      thing.y = y + random_.uniform(-0.15, 0.15);
      thing.yaw = yaw;
      if (is_off_the_path(thing, 0.35) && has_room(thing, before_, 0.02)) before_.push_back(thing);
    };
    const double inner_x = width / 2 - 1.25, inner_y = height / 2 - 1.2;
    for (int i = -1; i <= 1; ++i) {
      for (const double side : {1.0, -1.0})
        put(i != 0 ? "large" : "long", i * inner_x, side * inner_y, 0.0);
    }
    put("wide", inner_x + 0.3, 0.0, 0.0);
    for (int i = -1; i <= 1; ++i) {
      for (const double side : {1.0, -1.0}) {
        put("long", i * 1.35, side * (height / 2 + 0.95), 0.0);
        put("wide", side * (width / 2 + 0.95), i * 1.35, 0.0);
      }
    }
    const std::vector<std::string> fences = {"fence1", "fence2", "fence3"};
    for (const double sx : {-1.0, 1.0}) {
      for (const double sy : {-1.0, 1.0}) {
        put(one_of(fences), sx * (width / 2 + 0.5), sy * (height / 2 + 1.2), 0.0);
        put(one_of(fences), sx * (width / 2 + 1.25), sy * (height / 2 + 0.4), M_PI / 2);
      }
    }
  }

  /// Pixels of each thing within the depth limit, over a lap.
  std::vector<int> seen(const Things& things, const std::vector<Eye>& lap) const {
    CameraModel coarse = camera_;
    coarse.width /= 4, coarse.height /= 4, coarse.fx /= 4, coarse.fy /= 4;
    coarse.cx = (coarse.cx + 0.5) / 4 - 0.5, coarse.cy = (coarse.cy + 0.5) / 4 - 0.5;
    const Scene scene = scene_of(things);
    std::vector<int> pixels(things.size(), 0);
    for (std::size_t i = 0; i < lap.size(); i += 4) {
      const RenderedFrame picture = render(scene, coarse, camera_pose(lap[i]), false);
      for (int row = 0; row < coarse.height; ++row) {
        for (int col = 0; col < coarse.width; ++col) {
          const int thing = picture.objects.at<int>(row, col) - static_cast<int>(building_.size());
          if (thing >= 0 && picture.depth_m.at<float>(row, col) < kMaxDepth_m) ++pixels[thing];
        }
      }
    }
    return pixels;
  }
  /// Whether the second lap would see the thing, or its place.
  bool is_seen_later(const Things& things, const std::string& name) const {
    const auto at = std::find_if(things.begin(), things.end(),
                                 [&](const Thing& thing) { return thing.name == name; });
    return at != things.end() && seen(things, paths_[1])[at - things.begin()] >= kSeenPixels;
  }
  /// Whether another thing of its kind that changes stands so near that they may be mistaken.
  bool is_ambiguous(const Thing& thing, const Things& others) const {
    return std::any_of(others.begin(), others.end(), [&](const Thing& other) {
      return other.name != thing.name && other.kind == thing.kind && state_.count(other.name) > 0 &&
             std::hypot(thing.x - other.x, thing.y - other.y) < kTellApart_m;
    });
  }

  void change() {
    after_ = before_;
    const std::vector<int> pixels = seen(before_, paths_[0]);
    std::vector<Thing> candidates;
    for (std::size_t i = 0; i < before_.size(); ++i) {
      if (before_[i].moves && pixels[i] >= kSeenPixels) candidates.push_back(before_[i]);
    }
    for (std::size_t i = candidates.size(); i > 1; --i)
      std::swap(candidates[i - 1], candidates[random_.below(i)]);
    int removed = 0, moved = 0;
    for (const Thing& thing : candidates) {
      if (!is_seen_later(after_, thing.name)) continue;
      if (removed < style_.removed) {
        after_.erase(std::find_if(after_.begin(), after_.end(),
                                  [&](const Thing& o) { return o.name == thing.name; }));
        state_[thing.name] = "removed";
        ++removed;
      } else if (moved < style_.moved && !is_ambiguous(thing, before_) &&
                 !is_ambiguous(thing, after_)) {
        moved += move(thing);
      }
    }
    for (int added = 0, tries = 0; added < style_.added && tries < 400; ++tries) {
      Thing thing;
      thing.name = "new_" + std::to_string(added);
      thing.kind = one_of(style_.new_kinds);
      thing.x = random_.uniform(-style_.new_reach_m.x(), style_.new_reach_m.x());
      thing.y = random_.uniform(-style_.new_reach_m.y(), style_.new_reach_m.y());
      thing.yaw = random_.uniform(-style_.new_turn_rad, style_.new_turn_rad);
      if (is_ambiguous(thing, before_) || is_ambiguous(thing, after_) ||
          !is_off_the_path(thing, 0.5) || !has_room(thing, after_, 0.02)) {
        continue;
      }
      Things trial = after_;
      trial.push_back(thing);
      if (!is_seen_later(trial, thing.name)) continue;
      after_ = trial;
      state_[thing.name] = "added";
      ++added;
    }
  }

  bool move(const Thing& thing) {
    for (int tries = 0; tries < 60; ++tries) {
      Thing there = thing;
      const double way_m = random_.uniform(0.3, 1.5), towards = random_.uniform(-M_PI, M_PI);
      there.x += way_m * std::cos(towards);
      there.y += way_m * std::sin(towards);
      if (random_.uniform() < (warehouse_ ? 0.5 : 0.2)) there.yaw += random_.uniform(-0.5, 0.5);
      if (is_ambiguous(there, before_) || !is_off_the_path(there, 0.4) ||
          !has_room(there, after_, 0.02)) {
        continue;
      }
      Things trial = after_;
      *std::find_if(trial.begin(), trial.end(),
                    [&](const Thing& o) { return o.name == thing.name; }) = there;
      if (!is_seen_later(trial, thing.name)) continue;
      after_ = trial;
      state_[thing.name] = "moved";
      return true;
    }
    return false;
  }

  SensorModel sensor_model() const {
    SensorModel sensor;
    sensor.depth_base_m = 0.001;
    sensor.depth_quadratic_per_m = 0.002;
    sensor.position_error_m = 0.012;
    sensor.rotation_error_deg = 0.2;
    sensor.alias_share = 0.0;
    sensor.label_blobs_per_frame = 0.2;
    sensor.label_border_px = 1.0;
    sensor.max_range_m = 10.0;
    sensor.hole_blobs_per_frame = 0.5;
    sensor.edge_hole_px = 1.0;
    if (seed_ % 2 == 1) {
      sensor.fattening_px = 1.0;
      sensor.flying_px = 1.0;
      sensor.flying_share = 0.2;
      sensor.label_bleed_px = 1.0;
      sensor.label_stride_px = 2;
    }
    return sensor;
  }

  void note_first_seen(const RenderedFrame& picture, int frame, const Things& things,
                       std::map<std::string, int>& first_seen) const {
    constexpr int kPixels = 10;  // of every second pixel of every second row
    std::vector<int> pixels(things.size(), 0);
    for (int row = 0; row < camera_.height; row += 2) {
      for (int col = 0; col < camera_.width; col += 2) {
        const int thing = picture.objects.at<int>(row, col) - static_cast<int>(building_.size());
        if (thing >= 0 && picture.depth_m.at<float>(row, col) < kMaxDepth_m) ++pixels[thing];
      }
    }
    for (std::size_t i = 0; i < things.size(); ++i) {
      if (pixels[i] >= kPixels) first_seen.emplace(things[i].name, frame);
    }
  }

  /// name class state, now x y yaw, before x y yaw, extent low and high, first frame that saw it
  /// (-1: none).
  void write_truth(const std::filesystem::path& file,
                   const std::map<std::string, int>& first_seen) const {
    std::ofstream out(file);
    const auto line = [&](const Thing& now, const Thing& old, const std::string& state) {
      const Kind& kind = kinds_.at(now.kind);
      const auto seen = first_seen.find(now.name);
      out << now.name << " " << kind.class_id << " " << state << " " << now.x << " " << now.y << " "
          << now.yaw << " " << old.x << " " << old.y << " " << old.yaw << " "
          << kind.low.transpose() << " " << kind.high.transpose() << " "
          << (seen == first_seen.end() ? -1 : seen->second) << "\n";
    };
    const auto find = [&](const std::string& name) {
      return std::find_if(after_.begin(), after_.end(),
                          [&](const Thing& thing) { return thing.name == name; });
    };
    for (const Thing& thing : before_) {
      if (!thing.moves) continue;
      const auto state = state_.find(thing.name);
      const auto now = find(thing.name);
      line(now == after_.end() ? thing : *now, thing,
           state == state_.end() ? "kept" : state->second);
    }
    for (const Thing& thing : after_) {
      const auto state = state_.find(thing.name);
      if (state != state_.end() && state->second == "added") line(thing, thing, "added");
    }
    if (!out.flush()) throw InputError(file.string() + ": cannot be written");
  }

  bool warehouse_;
  std::uint64_t seed_;
  Random random_;
  CameraModel camera_;
  Pose T_B_C_ = Pose::Identity();
  std::map<std::string, Kind> kinds_;
  Style style_{};
  std::vector<SceneObject> building_;
  std::vector<Eye> paths_[2];
  Things before_, after_;
  std::map<std::string, std::string> state_;  ///< of what changes
};

}  // namespace

int main(int argc, char** argv) {
  const std::string kind = argc > 1 ? argv[1] : "";
  const bool help = kind == "--help" || kind == "-h";
  if (help || ((kind != "circuit" || argc < 4) && (kind != "warehouse" || argc != 5))) {
    (help ? std::cout : std::cerr)
        << "Makes two laps through a place of random layout in which things change.\n"
           "usage: pocd_changed_scene circuit SEED OUTPUT_DIR\n"
           "       pocd_changed_scene warehouse SEED OUTPUT_DIR MESH_DIR\n"
           "Exit code: 0 done, 1 inputs or outputs unusable, 2 usage.\n";
    return help ? 0 : 2;
  }
  try {
    const SceneMaker scene(kind == "warehouse", std::stoull(argv[2]), argc > 4 ? argv[4] : "");
    scene.write(argv[3]);
  } catch (const std::exception& error) {
    std::cerr << "pocd_changed_scene: " << error.what() << "\n";
    return 1;
  }
  return 0;
}

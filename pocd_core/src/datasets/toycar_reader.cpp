#include <algorithm>
#include <cmath>

#include "image_file.hpp"
#include "listed_reader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"
#include "text_file.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

struct Entry {
  std::size_t folder;
  Pose T_W_C = Pose::Identity();
  fs::path depth, labels, color;  // the latter two may be empty
  std::string problem;            // not empty: the frame cannot be used
  bool has_pose = false;
};

struct Folder {
  CameraModel camera;
  Eigen::Quaterniond R_level_W;
};

CameraModel read_calibration(const fs::path& file) {
  const Eigen::MatrixXd row = read_matrix(file, 1, 6);
  CameraModel camera;
  camera.fx = row(0, 0), camera.fy = row(0, 1), camera.cx = row(0, 2), camera.cy = row(0, 3);
  if (row(0, 4) != std::floor(row(0, 4)) || row(0, 5) != std::floor(row(0, 5))) {
    throw InputError(file.string() + ": width and height must be whole numbers");
  }
  // Out of range for a camera, too, and no int is undefined.
  const auto side = [](double value) { return static_cast<int>(std::clamp(value, -1.0, 1e9)); };
  camera.width = side(row(0, 4)), camera.height = side(row(0, 5));
  validate(camera, file.string());
  return camera;
}

Pose parse_pose(const NumberedLine& line, const fs::path& file) {
  const std::vector<double> n = parse_numbers(line, 8, file);
  const Eigen::Quaterniond q(n[7], n[4], n[5], n[6]);
  if (std::abs(q.norm() - 1.0) > 1e-2) {
    throw InputError(place(file, line.number) + ": quaternion has length " +
                     std::to_string(q.norm()) + ", not 1");
  }
  Pose T_W_C = Pose::Identity();
  T_W_C.translation() = Eigen::Vector3d(n[1], n[2], n[3]);
  T_W_C.linear() = q.normalized().toRotationMatrix();
  return T_W_C;
}

/// The sensor-like depth if there is a choice.
fs::path depth_folder(const fs::path& path) {
  for (const char* name : {"depth_noise", "depth_original", "depth"}) {
    std::error_code unreadable;  // is none then
    if (fs::is_directory(path / name, unreadable)) return path / name;
  }
  throw InputError(path.string() + ": has no folder depth_noise, depth_original or depth");
}

class ToycarReader : public ListedReader<Entry> {
 public:
  explicit ToycarReader(const DatasetOptions& options) : ListedReader(options.frame_rate_hz) {
    for (const fs::path& path : options.inputs) {
      require_folder(path);
      folders_.push_back(
          {options.camera ? *options.camera : read_calibration(path / "calibration.txt"),
           read_levelling(path, options.gravity_W)});
      list(path);
    }
  }

 private:
  void list(const fs::path& path) {
    const fs::path from = depth_folder(path);
    std::map<int, fs::path> depths = numbered_files(from, "Depth", ".exr");
    depths.merge(numbered_files(from, "Depth", ".png"));
    if (depths.empty()) {
      throw InputError(from.string() + ": no DepthNNNN.exr or DepthNNNN.png in it");
    }
    const auto labels = numbered_files(path / "mask_id", "Mask", ".png");
    const auto colors = numbered_files(path / "colour", "Color", ".png");
    std::map<int, Entry> by_number;
    for (const auto& [number, file] : depths) {
      Entry& entry = by_number[number];
      entry.folder = folders_.size() - 1;
      entry.depth = file;
      entry.problem = file.string() + ": trajectories/gt-cam-0.txt has no pose for it";
      const auto take = [&, index = number](const auto& files, fs::path& to) {
        const auto found = files.find(index);
        if (found != files.end()) to = found->second;
      };
      take(labels, entry.labels);
      take(colors, entry.color);
    }
    read_trajectory(path / "trajectories" / "gt-cam-0.txt", by_number);
    for (auto& [number, entry] : by_number) {
      if (entry.problem.empty() && entry.labels.empty() && !labels.empty()) {
        entry.problem = entry.depth.string() + ": has no image in mask_id";
      }
      entries_.push_back(std::move(entry));
    }
  }

  void read_trajectory(const fs::path& file, std::map<int, Entry>& by_number) {
    for (const NumberedLine& line : read_lines(file)) {
      const std::optional<int> number = leading_index(line);
      if (!number) {
        problems_.push_back(place(file, line.number) + ": does not begin with an image number");
        continue;
      }
      const auto found = by_number.find(*number);
      if (found == by_number.end()) {
        problems_.push_back(place(file, line.number) + ": there is no depth image " +
                            std::to_string(*number));
        continue;
      }
      if (std::exchange(found->second.has_pose, true)) {
        problems_.push_back(place(file, line.number) + ": number " + std::to_string(*number) +
                            " again");
        continue;
      }
      try {
        found->second.T_W_C = parse_pose(line, file);
        found->second.problem.clear();
      } catch (const InputError& error) {
        found->second.problem = error.what();
      }
    }
  }

  Frame read(std::size_t index) override {
    const Entry& entry = entries_[index];
    if (!entry.problem.empty()) throw InputError(entry.problem);
    const Folder& folder = folders_[entry.folder];
    const cv::Size size = image_size(folder.camera);
    const cv::Mat depth = entry.depth.extension() == ".exr" ? read_metre_image(entry.depth, size)
                                                            : read_depth_image(entry.depth, size);
    const cv::Mat labels = entry.labels.empty() ? cv::Mat() : read_id_image(entry.labels, size);
    const cv::Mat color = entry.color.empty() ? cv::Mat() : read_color_image(entry.color, size);
    return make_frame(stamp_ns(index), folder.camera, folder.R_level_W * entry.T_W_C, depth, labels,
                      color, entry.depth.string());
  }

  std::vector<Folder> folders_;
};

}  // namespace

std::unique_ptr<DatasetReader> open_toycar(const DatasetOptions& options) {
  return std::make_unique<ToycarReader>(options);
}

}  // namespace pocd

#include <cmath>
#include <set>

#include "image_file.hpp"
#include "listed_reader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"
#include "text_file.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

struct Folder {
  fs::path path;
  CameraModel camera;  // sizes come with the first depth image
  Eigen::Quaterniond R_level_W;
};

struct Entry {
  std::size_t folder;
  int number;
  fs::path depth, pose, color;  // empty: the file is missing
};

CameraModel read_intrinsics(const fs::path& file) {
  const Eigen::MatrixXd K = read_matrix(file, 3, 3);
  CameraModel camera;
  camera.fx = K(0, 0), camera.fy = K(1, 1), camera.cx = K(0, 2), camera.cy = K(1, 2);
  for (const auto& [field, value] : {std::pair("fx", camera.fx), std::pair("fy", camera.fy)}) {
    if (value > 0.0) continue;
    throw InputError(file.string() + ": camera " + field + " = " + std::to_string(value) +
                     ", must be > 0");
  }
  if (K(0, 1) != 0.0 || K(1, 0) != 0.0 || K(2, 0) != 0.0 || K(2, 1) != 0.0 || K(2, 2) != 1.0) {
    throw InputError(file.string() + ": is no intrinsics matrix [fx 0 cx; 0 fy cy; 0 0 1]");
  }
  return camera;
}

class RgbdReader : public ListedReader<Entry> {
 public:
  explicit RgbdReader(const DatasetOptions& options) : ListedReader(options.frame_rate_hz) {
    for (const fs::path& path : options.inputs) {
      require_folder(path);
      folders_.push_back({path, read_intrinsics(path / "camera-intrinsics.txt"),
                          read_levelling(path, options.gravity_W)});
      list(folders_.size() - 1);
    }
  }

 private:
  void list(std::size_t folder) {
    const fs::path& path = folders_[folder].path;
    const auto depths = numbered_files(path, "frame-", ".depth.png");
    const auto poses = numbered_files(path, "frame-", ".pose.txt");
    auto colors = numbered_files(path, "frame-", ".color.jpg");
    colors.merge(numbered_files(path, "frame-", ".color.png"));
    std::set<int> numbers;
    for (const auto* files : {&depths, &poses, static_cast<decltype(&depths)>(&colors)}) {
      for (const auto& file : *files) numbers.insert(file.first);
    }
    if (depths.empty()) throw InputError(path.string() + ": no frame-NNNNNN.depth.png in it");
    const auto file_of = [](const std::map<int, fs::path>& files, int number) {
      const auto found = files.find(number);
      return found == files.end() ? fs::path() : found->second;
    };
    for (const int number : numbers) {
      entries_.push_back({folder, number, file_of(depths, number), file_of(poses, number),
                          file_of(colors, number)});
    }
  }

  Frame read(std::size_t index) override {
    const Entry& entry = entries_[index];
    Folder& folder = folders_[entry.folder];
    const auto missing = [&](const char* what, const fs::path& present) {
      throw InputError(present.string() + ": has no " + what + " file beside it");
    };
    if (entry.depth.empty()) missing("depth", entry.pose.empty() ? entry.color : entry.pose);
    if (entry.pose.empty()) missing("pose", entry.depth);
    const Eigen::MatrixXd matrix = read_matrix(entry.pose, 4, 4);
    Pose T_W_C = Pose::Identity();
    T_W_C.matrix() = matrix;
    if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-6) {
      throw InputError(entry.pose.string() + ": last row is not 0 0 0 1");
    }
    validate_pose(T_W_C, entry.pose.string());
    T_W_C.linear() = Eigen::Quaterniond(T_W_C.linear()).normalized().toRotationMatrix();
    CameraModel camera = folder.camera;
    const cv::Mat depth = read_depth_image(entry.depth, image_size(camera));
    if (camera.width == 0) camera.width = depth.cols, camera.height = depth.rows;
    const cv::Mat color =
        entry.color.empty() ? cv::Mat() : read_color_image(entry.color, image_size(camera));
    const Pose T_level_C = folder.R_level_W * T_W_C;
    Frame frame = make_frame(stamp_ns(index), camera, T_level_C, depth, cv::Mat(), color,
                             entry.depth.string());
    folder.camera = camera;
    return frame;
  }

  std::vector<Folder> folders_;
};

}  // namespace

std::unique_ptr<DatasetReader> open_rgbd(const DatasetOptions& options) {
  return std::make_unique<RgbdReader>(options);
}

}  // namespace pocd

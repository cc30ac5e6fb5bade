#include <cmath>

#include "image_file.hpp"
#include "listed_reader.hpp"
#include "pocd/common/check.hpp"
#include "pocd/datasets/readers.hpp"
#include "pocd/input/torwic_camera.hpp"
#include "text_file.hpp"

namespace pocd {
namespace {

namespace fs = std::filesystem;

struct Entry {
  fs::path folder;
  int number = 0;
  bool has_pose = false;
  std::string problem;  // not empty: the frame is bad, and why
  StampNs stamp_ns = 0;
  Pose T_W_B = Pose::Identity();
  fs::path depth, labels, color;
};

/// One line of poses.txt.
void parse_pose(const NumberedLine& line, const fs::path& file, Entry& entry) {
  const std::vector<double> v = parse_numbers(line, 10, file);
  const auto whole = [](double x) { return x >= 0.0 && x == std::floor(x); };
  if (!whole(v[1]) || !whole(v[2]) || v[1] > 9e9 || v[2] >= 1e9) {
    throw InputError(place(file, line.number) + ": stamp " + std::to_string(v[1]) + " s " +
                     std::to_string(v[2]) + " ns is not valid");
  }
  const Eigen::Quaterniond q(v[9], v[6], v[7], v[8]);
  if (std::abs(q.norm() - 1.0) > 1e-2) {
    throw InputError(place(file, line.number) + ": quaternion has length " +
                     std::to_string(q.norm()) + ", must be 1");
  }
  entry.stamp_ns = static_cast<StampNs>(v[1]) * 1'000'000'000 + static_cast<StampNs>(v[2]);
  entry.T_W_B.translation() = Eigen::Vector3d(v[3], v[4], v[5]);
  entry.T_W_B.linear() = q.normalized().toRotationMatrix();
}

/// The time that a robot takes from one pose to another at kWalk_mps and kTurn_dps.
StampNs way_ns(const Pose& from, const Pose& to) {
  constexpr double kWalk_mps = 1.0, kTurn_dps = 90.0;
  const double way_m = (to.translation() - from.translation()).norm();
  const double turn_deg =
      Eigen::AngleAxisd(from.linear().transpose() * to.linear()).angle() * 180.0 / M_PI;
  return static_cast<StampNs>(1e9 * std::max(way_m / kWalk_mps, turn_deg / kTurn_dps));
}

class TorwicReader : public ListedReader<Entry> {
 public:
  explicit TorwicReader(const DatasetOptions& options)
      : ListedReader(options.frame_rate_hz),
        camera_(options.camera.value_or(torwic_camera())),
        extrinsics_(options.extrinsics.value_or(torwic_extrinsics())) {
    validate(camera_, "torwic camera");
    validate_pose(extrinsics_.T_B_C, "torwic camera mount");
    for (const fs::path& folder : options.inputs) {
      require_folder(folder);
      stitch(list(folder));
    }
  }

  std::size_t size() const override { return entries_.size() + lines_without_frame_; }
  CameraExtrinsics extrinsics() const override { return extrinsics_; }

 private:
  std::vector<Entry> list(const fs::path& folder) {
    const fs::path pose_file = folder / "poses.txt";
    std::map<int, Entry> entries;
    for (const NumberedLine& line : read_lines(pose_file)) {
      const std::optional<int> number = leading_index(line);
      if (!number) {
        skip(place(pose_file, line.number) + ": does not begin with an image index");
        ++lines_without_frame_;
        continue;
      }
      if (entries.count(*number)) {
        skip(place(pose_file, line.number) + ": index " + std::to_string(*number) + " again");
        ++lines_without_frame_;
        continue;
      }
      Entry& entry = entries[*number];
      entry.has_pose = true;
      try {
        parse_pose(line, pose_file, entry);
      } catch (const InputError& error) {
        entry.problem = error.what();
      }
    }
    const auto depths = numbered_files(folder / "Depth", "", ".png");
    const auto labels = numbered_files(folder / "Segmentation", "", ".png");
    const auto colors = numbered_files(folder / "RGB", "", ".png");
    if (depths.empty()) throw InputError((folder / "Depth").string() + ": no images in it");
    for (const auto& [number, file] : depths) {
      Entry& entry = entries[number];
      if (!entry.has_pose) {
        entry.problem = file.string() + ": poses.txt has no line with this index";
      }
    }
    std::vector<Entry> out;
    for (auto& [number, entry] : entries) {
      entry.folder = folder;
      entry.number = number;
      const auto take = [&, index = number](const std::map<int, fs::path>& files, const char* name,
                                            bool optional, Entry& to, fs::path& path) {
        const auto found = files.find(index);
        if (found != files.end()) {
          path = found->second;
        } else if (to.problem.empty() && !(optional && files.empty())) {
          to.problem = (folder / name).string() + ": no image " + std::to_string(index) +
                       ", which poses.txt lists";
        }
      };
      take(depths, "Depth", false, entry, entry.depth);
      take(labels, "Segmentation", true, entry, entry.labels);
      take(colors, "RGB", true, entry, entry.color);
      out.push_back(std::move(entry));
    }
    return out;
  }

  /// Appends a folder's frames. Its stamps are shifted: it begins a period after the last one so
  /// far, or when the camera can have come from there.
  void stitch(std::vector<Entry> fresh) {
    StampNs last_own_ns = -1, shift_ns = 0;
    bool first = true;
    for (Entry& entry : fresh) {
      if (entry.problem.empty()) {
        if (entry.stamp_ns <= last_own_ns) {
          entry.problem = (entry.folder / "poses.txt").string() + ": stamp of image " +
                          std::to_string(entry.number) + " is not after the one before";
        } else {
          last_own_ns = entry.stamp_ns;
          if (first && !entries_.empty()) {
            shift_ns = last_stamp_ns_ + std::max(period_ns_, way_ns(last_T_W_B_, entry.T_W_B)) -
                       entry.stamp_ns;
          }
          first = false;
          last_T_W_B_ = entry.T_W_B;
          entry.stamp_ns += shift_ns;
          last_stamp_ns_ = entry.stamp_ns;
        }
      }
      entries_.push_back(std::move(entry));
    }
  }

  Frame read(std::size_t index) override {
    const Entry& entry = entries_[index];
    if (!entry.problem.empty()) throw InputError(entry.problem);
    const cv::Mat depth = read_depth_image(entry.depth, image_size(camera_));
    const cv::Mat labels =
        entry.labels.empty() ? cv::Mat() : read_label_image(entry.labels, image_size(camera_));
    const cv::Mat color =
        entry.color.empty() ? cv::Mat() : read_color_image(entry.color, image_size(camera_));
    return make_frame(entry.stamp_ns, camera_, entry.T_W_B * extrinsics_.T_B_C, depth, labels,
                      color, entry.depth.string());
  }

  CameraModel camera_;
  CameraExtrinsics extrinsics_;
  std::size_t lines_without_frame_ = 0;
  StampNs last_stamp_ns_ = 0;
  Pose last_T_W_B_ = Pose::Identity();
};

}  // namespace

std::unique_ptr<DatasetReader> open_torwic(const DatasetOptions& options) {
  return std::make_unique<TorwicReader>(options);
}

}  // namespace pocd

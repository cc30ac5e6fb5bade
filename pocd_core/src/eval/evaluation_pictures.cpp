#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "pocd/common/check.hpp"
#include "pocd/eval/evaluation_report.hpp"

namespace pocd {
namespace {

constexpr int kCell_px = 10, kBorder_px = 30;
const cv::Scalar kWhite(255, 255, 255), kBlack(0, 0, 0), kGrey(200, 200, 200);
// Blue, green, red. Distinct hues (Okabe and Ito's palette for the colour blind).
const std::array<cv::Scalar, 8> kLines{cv::Scalar(178, 114, 0),  cv::Scalar(0, 94, 213),
                                       cv::Scalar(115, 158, 0),  cv::Scalar(167, 121, 204),
                                       cv::Scalar(0, 159, 230),  cv::Scalar(233, 180, 86),
                                       cv::Scalar(66, 228, 240), cv::Scalar(90, 90, 90)};

void label(cv::Mat& image, const std::string& text, const cv::Point& at, double scale = 0.45) {
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, scale, kBlack, 1, cv::LINE_AA);
}

void write(const cv::Mat& image, const std::filesystem::path& file) {
  if (!cv::imwrite(file.string(), image)) throw InputError(file.string() + ": cannot be written");
}

/// A plot of values in [0, 1] over x in [low, high].
class Plot {
 public:
  Plot(int width, int height, double low, double high)
      : image_(height, width, CV_8UC3, kWhite), low_(low), high_(std::max(high, low + 1e-9)) {
    for (int i = 0; i <= 10; i += 2) {
      const cv::Point left = at(low_, i / 10.0), right = at(high_, i / 10.0);
      cv::line(image_, left, right, kGrey);
      label(image_, "0." + std::to_string(i % 10), {left.x - 30, left.y + 4}, 0.35);
      if (i == 10)
        cv::rectangle(image_, cv::Rect(left.x - 32, left.y - 8, 30, 14), kWhite, cv::FILLED);
      if (i == 10) label(image_, "1.0", {left.x - 30, left.y + 4}, 0.35);
    }
    cv::rectangle(image_, at(low_, 0), at(high_, 1), kBlack);
  }
  cv::Point at(double x, double y) const {
    const double w = image_.cols - 2 * kMargin, h = image_.rows - 2 * kMargin;
    return {static_cast<int>(std::lround(kMargin + (x - low_) / (high_ - low_) * w)),
            static_cast<int>(std::lround(image_.rows - kMargin - y * h))};
  }
  cv::Mat& image() { return image_; }

 private:
  static constexpr int kMargin = 45;
  cv::Mat image_;
  double low_, high_;
};

}  // namespace

void draw_voxels(const VoxelScore& score, double voxel_size_m, const std::string& title,
                 const std::filesystem::path& file) {
  std::map<std::pair<int, int>, VoxelVerdict> columns;
  int low_x = 0, high_x = 1, low_y = 0, high_y = 1;
  if (!score.voxels.empty()) {
    low_x = high_x = score.voxels.begin()->first.x;
    low_y = high_y = score.voxels.begin()->first.y;
  }
  const auto rank = [](VoxelVerdict v) {
    return v == VoxelVerdict::kFalsePositive ? 2 : v == VoxelVerdict::kFalseNegative ? 1 : 0;
  };
  for (const auto& [voxel, verdict] : score.voxels) {
    low_x = std::min(low_x, voxel.x), high_x = std::max(high_x, voxel.x);
    low_y = std::min(low_y, voxel.y), high_y = std::max(high_y, voxel.y);
    const auto [place, fresh] = columns.emplace(std::make_pair(voxel.x, voxel.y), verdict);
    if (!fresh && rank(verdict) > rank(place->second)) place->second = verdict;
  }
  const int width = std::max(420, (high_x - low_x + 1) * kCell_px + 2 * kBorder_px);
  cv::Mat image((high_y - low_y + 1) * kCell_px + 3 * kBorder_px, width, CV_8UC3, kWhite);
  for (const auto& [at, verdict] : columns) {
    const cv::Scalar color = verdict == VoxelVerdict::kTruePositive    ? cv::Scalar(80, 175, 76)
                             : verdict == VoxelVerdict::kFalsePositive ? cv::Scalar(54, 67, 244)
                                                                       : cv::Scalar(59, 205, 250);
    const cv::Rect cell(kBorder_px + (at.first - low_x) * kCell_px,
                        2 * kBorder_px + (high_y - at.second) * kCell_px, kCell_px, kCell_px);
    cv::rectangle(image, cell, color, cv::FILLED);
  }
  label(image, title, {10, 20});
  char text[120];
  std::snprintf(text, sizeof(text), "precision %.1f  recall %.1f  FPR %.2f %%   one cell: %.2f m",
                score.precision(), score.recall(), score.false_positive_rate(), voxel_size_m);
  label(image, text, {10, 40}, 0.4);
  write(image, file);
}

void draw_histories(const MethodScore& score, double remove_below,
                    const std::filesystem::path& file) {
  std::set<ObjectId> changed;
  for (const auto& timed : score.events) {
    if (timed.event.kind == EventKind::kRemoved || timed.event.kind == EventKind::kMoved) {
      changed.insert(timed.event.object);
    }
  }
  std::vector<ObjectId> ids;
  for (const auto& [id, history] : score.histories) ids.push_back(id);
  std::stable_sort(ids.begin(), ids.end(), [&](ObjectId a, ObjectId b) {
    if (changed.count(a) != changed.count(b)) return changed.count(a) > changed.count(b);
    return score.histories.at(a).size() > score.histories.at(b).size();
  });
  // Two that did not change are shown beside those that did.
  const std::size_t of_changed = std::min<std::size_t>(changed.size(), 6);
  if (ids.size() > of_changed) {
    ids.erase(ids.begin() + static_cast<std::ptrdiff_t>(of_changed),
              ids.begin() + static_cast<std::ptrdiff_t>(std::min(changed.size(), ids.size())));
  }
  if (ids.size() > kLines.size()) ids.resize(kLines.size());
  Plot plot(900, 420, 0.0, static_cast<double>(score.frames));
  cv::line(plot.image(), plot.at(0, remove_below),
           plot.at(static_cast<double>(score.frames), remove_below), cv::Scalar(54, 67, 244), 1,
           cv::LINE_AA);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const History& history = score.histories.at(ids[i]);
    for (std::size_t n = 0; n < history.size(); ++n) {
      const cv::Point now = plot.at(static_cast<double>(history[n].first), history[n].second);
      // A gap in time, during which the object was out of view, is drawn as a step.
      if (n > 0) {
        const cv::Point before =
            plot.at(static_cast<double>(history[n - 1].first), history[n - 1].second);
        cv::line(plot.image(), before, {now.x, before.y}, kLines[i], 1, cv::LINE_AA);
        cv::line(plot.image(), {now.x, before.y}, now, kLines[i], 2, cv::LINE_AA);
      } else {
        cv::circle(plot.image(), now, 3, kLines[i], cv::FILLED, cv::LINE_AA);
      }
    }
    const std::string name =
        std::to_string(to_index(ids[i])) + (changed.count(ids[i]) ? " changed" : "");
    cv::putText(plot.image(), name, {60 + static_cast<int>(i) * 100, 30}, cv::FONT_HERSHEY_SIMPLEX,
                0.4, kLines[i], 1, cv::LINE_AA);
  }
  label(plot.image(), "E[v] of objects over frames, " + score.method, {60, 14}, 0.4);
  write(plot.image(), file);
}

void draw_reliability(const Calibration& calibration, const std::string& title,
                      const std::filesystem::path& file) {
  Plot plot(460, 460, 0.0, 1.0);
  cv::line(plot.image(), plot.at(0, 0), plot.at(1, 1), kGrey, 1, cv::LINE_AA);
  std::optional<cv::Point> before;
  for (const Calibration::Bin& bin : calibration.bins()) {
    if (bin.count == 0) continue;
    const auto n = static_cast<double>(bin.count);
    const cv::Point at = plot.at(bin.sum_predicted / n, static_cast<double>(bin.true_count) / n);
    const int radius =
        2 + static_cast<int>(10.0 * std::sqrt(n / static_cast<double>(calibration.count())));
    cv::circle(plot.image(), at, radius, kLines[0], 1, cv::LINE_AA);
    if (before) cv::line(plot.image(), *before, at, kLines[0], 2, cv::LINE_AA);
    before = at;
  }
  char text[160];
  std::snprintf(text, sizeof(text), "%s: share in place over E[v], ECE %.3f", title.c_str(),
                calibration.expected_error());
  label(plot.image(), text, {20, 20}, 0.4);
  write(plot.image(), file);
}

}  // namespace pocd

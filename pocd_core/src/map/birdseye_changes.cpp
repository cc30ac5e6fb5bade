#include "birdseye_changes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

const cv::Scalar kWas(36, 28, 200), kNew(214, 96, 20);  // BGR

void dashed_line(cv::Mat& image, cv::Point2d from, cv::Point2d to) {
  constexpr double kDash = 7.0, kGap = 5.0;
  const double length = cv::norm(to - from);
  for (double at = 0.0; at < length; at += kDash + kGap) {
    const cv::Point2d a = from + (to - from) * (at / length);
    const cv::Point2d b = from + (to - from) * (std::min(at + kDash, length) / length);
    cv::line(image, a, b, kWas, 2, cv::LINE_AA);
  }
}

std::array<cv::Point2d, 4> pixels(const OrientedBox& box, const BirdseyeCanvas& canvas) {
  std::array<cv::Point2d, 4> at;
  const auto corners = floor_corners(box);
  for (int i = 0; i < 4; ++i) at[i] = canvas.to_pixel(corners[i].x(), corners[i].y());
  return at;
}

cv::Point2d center(const OrientedBox& box, const BirdseyeCanvas& canvas) {
  return canvas.to_pixel(box.pose.position_W.x(), box.pose.position_W.y());
}

void draw_legend(BirdseyeCanvas& canvas) {
  const int left = canvas.plot().x + canvas.plot().width + 22;
  const int top = canvas.plot().y + std::min(220, canvas.plot().height - 60) + 76;
  dashed_line(canvas.image(), {left + 0.0, top - 4.0}, {left + 22.0, top - 4.0});
  canvas.note("was here", {left + 28, top});
  cv::line(canvas.image(), {left, top + 16}, {left + 22, top + 16}, kNew, 2, cv::LINE_AA);
  canvas.note("new", {left + 28, top + 20});
}

}  // namespace

std::array<Eigen::Vector2d, 4> floor_corners(const OrientedBox& box) {
  const double c = std::cos(box.pose.yaw_rad), s = std::sin(box.pose.yaw_rad);
  const Eigen::Vector2d along = 0.5 * box.size_m.x() * Eigen::Vector2d(c, s);
  const Eigen::Vector2d across = 0.5 * box.size_m.y() * Eigen::Vector2d(-s, c);
  const Eigen::Vector2d center = box.pose.position_W.head<2>();
  return {center + along + across, center - along + across, center - along - across,
          center + along - across};
}

void draw_changes(const std::vector<BirdseyeChange>& changes, BirdseyeCanvas& canvas) {
  if (changes.empty()) return;
  for (const BirdseyeChange& change : changes) {
    POCD_CHECK(change.before || change.after);
    const auto at = pixels(change.before ? *change.before : *change.after, canvas);
    for (int i = 0; i < 4; ++i) {
      if (change.before) {
        dashed_line(canvas.image(), at[i], at[(i + 1) % 4]);
      } else {
        cv::line(canvas.image(), at[i], at[(i + 1) % 4], kNew, 2, cv::LINE_AA);
      }
    }
  }
  for (const BirdseyeChange& change : changes) {
    if (!change.before || !change.after) continue;
    const cv::Point2d from = center(*change.before, canvas), to = center(*change.after, canvas);
    const double tip = std::min(12.0 / std::max(cv::norm(to - from), 1.0), 0.5);
    cv::arrowedLine(canvas.image(), from, to, kWas, 2, cv::LINE_AA, 0, tip);
  }
  draw_legend(canvas);
}

std::vector<BirdseyeChange> changes_since(const std::vector<ObjectEvent>& events,
                                          StampNs since_ns) {
  std::map<ObjectId, BirdseyeChange> of;
  for (const ObjectEvent& event : events) {
    if (event.stamp_ns < since_ns) continue;
    if (event.absorbed) of.erase(*event.absorbed);
    const auto known = of.find(event.object);
    switch (event.kind) {
      case EventKind::kAdded:
        of[event.object].after = event.box;
        break;
      case EventKind::kUpdated:  // better measured
        if (known != of.end()) known->second.after = event.box;
        break;
      case EventKind::kMoved:
        if (known == of.end()) of[event.object].before = event.previous_box;
        of[event.object].after = event.box;
        break;
      case EventKind::kRemoved:
        if (known == of.end()) {
          of[event.object].before = event.box;
        } else {
          known->second.after.reset();
        }
        break;
      case EventKind::kOperator:
        if (known != of.end()) of.erase(known);
        break;
    }
  }
  std::vector<BirdseyeChange> changes;
  for (const auto& [object, change] : of) {
    if (change.before || change.after) changes.push_back(change);  // else it came and went
  }
  return changes;
}

}  // namespace pocd

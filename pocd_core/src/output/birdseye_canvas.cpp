#include "birdseye_canvas.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "pocd/output/birdseye.hpp"

namespace pocd {
namespace {

constexpr int kLeft = 62, kRight = 104, kTop = 54, kBottom = 56;
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
const cv::Scalar kInk(60, 56, 52), kFaint(226, 226, 224), kPaper(250, 250, 249);

// Largest of 1, 2, 5 times a power of ten that is at most `limit`.
double round_step(double limit) {
  const double power = std::pow(10.0, std::floor(std::log10(limit)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= limit) return factor * power;
  }
  return power;
}

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", std::abs(value) < 1e-9 ? 0.0 : value);
  return text;
}

cv::Size extent(const std::string& text, double size) {
  int below = 0;
  return cv::getTextSize(text, kFont, size, 1, &below);
}

}  // namespace

BirdseyeCanvas::BirdseyeCanvas(const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m,
                               int size_px)
    : low_m_(low_m), high_m_(high_m) {
  const Eigen::Vector2d span = high_m - low_m;
  scale_ = std::min((size_px - kLeft - kRight) / span.x(), (size_px - kTop - kBottom) / span.y());
  // A slim map still needs room for its title.
  const int width = std::max(240, static_cast<int>(std::ceil(span.x() * scale_)));
  const int height = std::max(200, static_cast<int>(std::ceil(span.y() * scale_)));
  const Eigen::Vector2d margin = 0.5 * (Eigen::Vector2d(width, height) / scale_ - span);
  low_m_ -= margin;
  high_m_ += margin;
  plot_ = cv::Rect(kLeft, kTop, width, height);
  image_ = cv::Mat(height + kTop + kBottom, width + kLeft + kRight, CV_8UC3, kPaper);
  step_m_ = round_step(std::max(span.x(), span.y()) / 5.0);
}

cv::Point2d BirdseyeCanvas::to_pixel(double x_m, double y_m) const {
  return {plot_.x + (x_m - low_m_.x()) * scale_, plot_.y + (high_m_.y() - y_m) * scale_};
}

void BirdseyeCanvas::draw_grid() {
  for (double x = std::ceil(low_m_.x() / step_m_) * step_m_; x <= high_m_.x(); x += step_m_) {
    const int u = cvRound(to_pixel(x, 0).x);
    cv::line(image_, {u, plot_.y}, {u, plot_.y + plot_.height}, kFaint, 1);
  }
  for (double y = std::ceil(low_m_.y() / step_m_) * step_m_; y <= high_m_.y(); y += step_m_) {
    const int v = cvRound(to_pixel(0, y).y);
    cv::line(image_, {plot_.x, v}, {plot_.x + plot_.width, v}, kFaint, 1);
  }
}

void BirdseyeCanvas::text(const std::string& text, cv::Point at, double size,
                          const cv::Scalar& color) {
  cv::putText(image_, text, at, kFont, size, color, 1, cv::LINE_AA);
}

void BirdseyeCanvas::label(const std::string& words, cv::Point2d center, double size) {
  const cv::Size area = extent(words, size);
  const cv::Point at(cvRound(center.x - area.width / 2.0), cvRound(center.y + area.height / 2.0));
  // A light outline keeps the label legible on every colour.
  cv::putText(image_, words, at, kFont, size, cv::Scalar(255, 255, 255), 4, cv::LINE_AA);
  text(words, at, size, kInk);
}

void BirdseyeCanvas::note(const std::string& words, cv::Point at) { text(words, at, 0.36, kInk); }

void BirdseyeCanvas::draw_axes() {
  cv::rectangle(image_, plot_, kInk, 1, cv::LINE_AA);
  const int bottom = plot_.y + plot_.height;
  for (double x = std::ceil(low_m_.x() / step_m_) * step_m_; x <= high_m_.x(); x += step_m_) {
    const int u = cvRound(to_pixel(x, 0).x);
    cv::line(image_, {u, bottom}, {u, bottom + 5}, kInk, 1);
    text(metres(x), {u - extent(metres(x), 0.42).width / 2, bottom + 20}, 0.42, kInk);
  }
  for (double y = std::ceil(low_m_.y() / step_m_) * step_m_; y <= high_m_.y(); y += step_m_) {
    const int v = cvRound(to_pixel(0, y).y);
    cv::line(image_, {plot_.x - 5, v}, {plot_.x, v}, kInk, 1);
    text(metres(y), {plot_.x - 10 - extent(metres(y), 0.42).width, v + 5}, 0.42, kInk);
  }
  text("x [m]", {plot_.x + plot_.width / 2 - 18, bottom + 42}, 0.46, kInk);
  text("y [m]", {8, plot_.y - 12}, 0.46, kInk);
}

void BirdseyeCanvas::draw_scale_bar() {
  const double length_m = round_step(0.2 * plot_.width / scale_);
  const int length = cvRound(length_m * scale_);
  const cv::Rect box(plot_.x + plot_.width - length - 34, plot_.y + plot_.height - 46, length + 24,
                     36);
  cv::rectangle(image_, box, cv::Scalar(255, 255, 255), cv::FILLED);
  cv::rectangle(image_, box, kFaint, 1);
  const int v = box.y + 26, u = box.x + 12;
  cv::rectangle(image_, cv::Rect(u, v, length, 4), kInk, cv::FILLED);
  const std::string words = metres(length_m) + " m";
  text(words, {u + length / 2 - extent(words, 0.42).width / 2, v - 8}, 0.42, kInk);
}

void BirdseyeCanvas::draw_legend() {
  const int height = std::min(220, plot_.height - 60);
  const cv::Rect bar(plot_.x + plot_.width + 24, plot_.y + 40, 16, height);
  for (int i = 0; i < height; ++i) {
    const auto color = stationarity_color(1.0 - static_cast<double>(i) / (height - 1));
    cv::line(image_, {bar.x, bar.y + i}, {bar.x + bar.width - 1, bar.y + i},
             cv::Scalar(color[0], color[1], color[2]), 1);
  }
  cv::rectangle(image_, bar, kInk, 1);
  for (const double score : {0.0, 0.5, 1.0}) {
    const int v = bar.y + cvRound((1.0 - score) * (height - 1));
    cv::line(image_, {bar.x + bar.width, v}, {bar.x + bar.width + 4, v}, kInk, 1);
    text(metres(score), {bar.x + bar.width + 9, v + 5}, 0.42, kInk);
  }
  text("E[v]", {bar.x - 2, bar.y - 24}, 0.46, kInk);
  text("stationary", {bar.x - 2, bar.y - 9}, 0.36, kInk);
  text("changing", {bar.x - 2, bar.y + height + 15}, 0.36, kInk);
}

void BirdseyeCanvas::decorate(const std::string& title, const std::string& note) {
  draw_axes();
  draw_scale_bar();
  draw_legend();
  text(title, {plot_.x, 26}, 0.68, kInk);
  const int title_end = plot_.x + extent(title, 0.68).width + 18;
  const bool beside = title_end + extent(note, 0.42).width < image_.cols - 10;
  text(note, beside ? cv::Point(title_end, 26) : cv::Point(plot_.x, 44), 0.42,
       cv::Scalar(120, 116, 112));
}

}  // namespace pocd

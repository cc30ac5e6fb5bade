// A plot in metres on a picture in pixels: axes, scale bar, colour legend.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>

namespace pocd {

/// World x to the right, y up. Draw the content between construction and decorate().
class BirdseyeCanvas {
 public:
  BirdseyeCanvas(const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m, int size_px);

  cv::Mat& image() { return image_; }
  const cv::Rect& plot() const { return plot_; }
  double pixels_per_m() const { return scale_; }
  cv::Point2d to_pixel(double x_m, double y_m) const;

  /// Faint lines at round distances, below the content.
  void draw_grid();
  void label(const std::string& text, cv::Point2d center, double size);
  /// Small words, for a legend beside the plot.
  void note(const std::string& words, cv::Point at);
  /// Frame, ticks, title, scale bar and the legend of the stationarity score.
  void decorate(const std::string& title, const std::string& note);

 private:
  void draw_axes();
  void draw_scale_bar();
  void draw_legend();
  void text(const std::string& text, cv::Point at, double size, const cv::Scalar& color);

  Eigen::Vector2d low_m_, high_m_;
  double scale_ = 1.0;
  double step_m_ = 1.0;  // between grid lines
  cv::Rect plot_;
  cv::Mat image_;
};

}  // namespace pocd

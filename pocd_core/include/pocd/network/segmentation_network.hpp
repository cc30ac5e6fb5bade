// Class masks from colour images, by an ONNX network that OpenCV runs. A library of its own
// (pocd::network): what does not use it does not load OpenCV's dnn module.
#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "pocd/input/class_map.hpp"
#include "pocd/input/dataset_reader.hpp"

namespace pocd {

/// Not thread-safe. Two networks of one process share the number of threads that was given last.
class SegmentationNetwork {
 public:
  /// Reads `model` and the file beside it that ends in .yaml instead (see network_config.hpp), and
  /// runs the network once. `classes` says which id a name has in the masks; `threads` >= 1 is how
  /// many OpenCV may use.
  ///
  /// Throws InputError naming the file and: the field and its value; the class that is not listed;
  /// the layer or operator that OpenCV has not; the shape of an output that does not fit.
  SegmentationNetwork(const std::filesystem::path& model, const ClassMap& classes, int threads);
  ~SegmentationNetwork();
  SegmentationNetwork(const SegmentationNetwork&) = delete;
  SegmentationNetwork& operator=(const SegmentationNetwork&) = delete;

  /// CV_8UC3 BGR of any size to CV_16UC1 of the same size: class id * label_divisor. Logits are
  /// interpolated between pixels, class numbers taken from the nearest one. Throws InputError when
  /// the network fails or gives numbers of no class.
  cv::Mat labels(const cv::Mat& color);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The same frames with the network's labels in place of their own. A frame without colour is
/// skipped. Throws InputError as the network does.
std::unique_ptr<DatasetReader> segmented(std::unique_ptr<DatasetReader> reader,
                                         std::shared_ptr<SegmentationNetwork> network);

}  // namespace pocd

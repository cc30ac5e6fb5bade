// What a segmentation network wants and gives, as the YAML file beside its model says.
#pragma once

#include <string>
#include <vector>

#include "pocd/common/describe.hpp"

namespace pocd {

/// One number for each colour.
struct ColourValues {
  double red = 0.0, green = 0.0, blue = 0.0;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("red", red, Range{-1e6, 1e6}, "Of the red channel.");
    visit("green", green, Range{-1e6, 1e6}, "Of the green channel.");
    visit("blue", blue, Range{-1e6, 1e6}, "Of the blue channel.");
  }
};

/// Order of the channels of the input.
enum class ChannelOrder {
  kRgb,  ///< red first
  kBgr,  ///< blue first
};
inline EnumWords<ChannelOrder> words_of(ChannelOrder) {
  return {{ChannelOrder::kRgb, "rgb"}, {ChannelOrder::kBgr, "bgr"}};
}

/// Order of the dimensions of input and output.
enum class TensorLayout {
  kNchw,  ///< channels before rows
  kNhwc,  ///< channels after columns
};
inline EnumWords<TensorLayout> words_of(TensorLayout) {
  return {{TensorLayout::kNchw, "nchw"}, {TensorLayout::kNhwc, "nhwc"}};
}

enum class NetworkOutput {
  kLogits,    ///< one plane per class, of which the largest value counts
  kClassIds,  ///< one plane of class numbers
};
inline EnumWords<NetworkOutput> words_of(NetworkOutput) {
  return {{NetworkOutput::kLogits, "logits"}, {NetworkOutput::kClassIds, "class_ids"}};
}

struct NetworkConfig {
  int input_width_px = 0;
  int input_height_px = 0;
  ChannelOrder channel_order = ChannelOrder::kRgb;
  TensorLayout layout = TensorLayout::kNchw;
  ColourValues mean;
  ColourValues scale{1.0 / 255, 1.0 / 255, 1.0 / 255};
  NetworkOutput output = NetworkOutput::kLogits;
  std::vector<std::string> classes;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("input_width_px", input_width_px, Range{0, 4096},
          "Width that an image is stretched to; must be given [pixels].");
    visit("input_height_px", input_height_px, Range{0, 4096},
          "Height that an image is stretched to; must be given [pixels].");
    visit("channel_order", channel_order, "Order of the channels of the input.");
    visit("layout", layout,
          "Order of the dimensions of input and output: channels before rows, or after columns.");
    visit.group("mean", mean, "Subtracted from each pixel's 0 to 255.");
    visit.group("scale", scale, "What that is multiplied by.");
    visit("output", output,
          "One plane per class, of which the largest value counts, or one plane of class numbers.");
    visit(
        "classes", classes,
        "Names of the network's classes in the order of its output; each is one of classes.list.");
  }
  std::vector<std::string> inconsistencies() const;
};

/// The file: one group.
struct NetworkFile {
  NetworkConfig network;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.group("network", network, "The network in the model of the same name.");
  }
};

}  // namespace pocd

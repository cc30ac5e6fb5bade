// Writes ONNX files of a few nodes, byte by byte: the fields of onnx.proto that a reader needs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace pocd {

/// A message of protocol buffers.
class Proto {
 public:
  Proto& number(int field, std::int64_t value) {
    varint(static_cast<std::uint64_t>(field) << 3);
    varint(static_cast<std::uint64_t>(value));
    return *this;
  }
  Proto& bytes(int field, const std::string& value) {
    varint(static_cast<std::uint64_t>(field) << 3 | 2);
    varint(value.size());
    text_ += value;
    return *this;
  }
  Proto& message(int field, const Proto& value) { return bytes(field, value.text_); }
  const std::string& text() const { return text_; }

 private:
  void varint(std::uint64_t value) {
    for (; value >= 128; value >>= 7) text_.push_back(static_cast<char>(value | 128));
    text_.push_back(static_cast<char>(value));
  }
  std::string text_;
};

struct TinyNode {
  std::string type;
  std::vector<std::string> inputs;
  std::string output;
  std::vector<std::pair<std::string, std::int64_t>> numbers = {};
  std::vector<std::pair<std::string, std::vector<std::int64_t>>> lists = {};
};

/// A network that takes the image "image" and gives "classes"; `weights` (class by channel) and
/// zero biases are there as "weights" and "bias".
class TinyOnnx {
 public:
  TinyOnnx(std::vector<std::int64_t> input_shape, std::vector<std::vector<float>> weights)
      : input_shape_(std::move(input_shape)), weights_(std::move(weights)) {}

  /// A 1x1 convolution: the value of a class is the weighted sum of a pixel's channels.
  static TinyOnnx convolution(int width, int height, std::vector<std::vector<float>> weights) {
    TinyOnnx onnx({1, 3, height, width}, std::move(weights));
    onnx.nodes = {convolve("image", "classes")};
    return onnx;
  }
  static TinyNode convolve(const std::string& input, const std::string& output) {
    return {"Conv", {input, "weights", "bias"}, output, {}, {{"kernel_shape", {1, 1}}}};
  }
  static TinyNode transpose(const std::string& input, const std::string& output,
                            std::vector<std::int64_t> order) {
    return {"Transpose", {input}, output, {}, {{"perm", std::move(order)}}};
  }
  static TinyNode arg_max(const std::string& input, const std::string& output) {
    return {"ArgMax", {input}, output, {{"axis", 1}, {"keepdims", 0}}, {}};
  }

  std::vector<TinyNode> nodes;

  void write(const std::filesystem::path& file) const {
    Proto graph;
    for (const TinyNode& node : nodes) graph.message(1, encoded(node));
    graph.bytes(2, "tiny");
    std::string values;
    for (const auto& row : weights_) {
      values.append(reinterpret_cast<const char*>(row.data()), row.size() * sizeof(float));
    }
    const auto classes = static_cast<std::int64_t>(weights_.size());
    const auto channels = static_cast<std::int64_t>(weights_.front().size());
    graph.message(5, tensor("weights", {classes, channels, 1, 1}, values));
    graph.message(5, tensor("bias", {classes},
                            std::string(static_cast<std::size_t>(classes) * sizeof(float), '\0')));
    graph.message(11, value("image", input_shape_));
    graph.message(12, value("classes", {}));
    Proto model;
    model.number(1, 7).message(7, graph).message(8, Proto().bytes(1, "").number(2, 11));
    std::ofstream(file, std::ios::binary) << model.text();
  }

 private:
  static Proto encoded(const TinyNode& node) {
    Proto proto;
    for (const std::string& input : node.inputs) proto.bytes(1, input);
    proto.bytes(2, node.output).bytes(3, node.output).bytes(4, node.type);
    constexpr int kInt = 2, kInts = 7;  // AttributeProto.type
    for (const auto& [name, value] : node.numbers) {
      proto.message(5, Proto().bytes(1, name).number(3, value).number(20, kInt));
    }
    for (const auto& [name, values] : node.lists) {
      Proto attribute;
      attribute.bytes(1, name);
      for (const std::int64_t value : values) attribute.number(8, value);
      proto.message(5, attribute.number(20, kInts));
    }
    return proto;
  }
  static Proto tensor(const std::string& name, const std::vector<std::int64_t>& shape,
                      const std::string& values) {
    Proto proto;
    for (const std::int64_t side : shape) proto.number(1, side);
    return proto.number(2, 1).bytes(8, name).bytes(9, values);
  }
  static Proto value(const std::string& name, const std::vector<std::int64_t>& shape) {
    Proto sides;
    for (const std::int64_t side : shape) sides.message(1, Proto().number(1, side));
    const Proto type = Proto().message(1, Proto().number(1, 1).message(2, sides));
    return Proto().bytes(1, name).message(2, type);
  }

  std::vector<std::int64_t> input_shape_;
  std::vector<std::vector<float>> weights_;
};

}  // namespace pocd

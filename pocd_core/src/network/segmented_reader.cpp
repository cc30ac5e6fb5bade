#include "pocd/network/segmentation_network.hpp"

namespace pocd {
namespace {

class SegmentedReader : public DatasetReader {
 public:
  SegmentedReader(std::unique_ptr<DatasetReader> reader,
                  std::shared_ptr<SegmentationNetwork> network)
      : reader_(std::move(reader)), network_(std::move(network)) {}

  std::optional<Frame> next() override {
    while (true) {
      std::optional<Frame> frame = reader_->next();
      for (; told_ < reader_->problems().size(); ++told_) {
        problems_.push_back(reader_->problems()[told_]);
      }
      skipped_ = reader_->skipped() + colourless_;
      if (!frame) return frame;
      if (frame->color.empty()) {
        ++colourless_;
        skip("frame " + std::to_string(frame->sequence) + ": no colour image for the network");
        continue;
      }
      frame->labels = network_->labels(frame->color);
      return frame;
    }
  }
  std::size_t size() const override { return reader_->size(); }
  CameraExtrinsics extrinsics() const override { return reader_->extrinsics(); }

 private:
  std::unique_ptr<DatasetReader> reader_;
  std::shared_ptr<SegmentationNetwork> network_;
  std::size_t told_ = 0, colourless_ = 0;
};

}  // namespace

std::unique_ptr<DatasetReader> segmented(std::unique_ptr<DatasetReader> reader,
                                         std::shared_ptr<SegmentationNetwork> network) {
  return std::make_unique<SegmentedReader>(std::move(reader), std::move(network));
}

}  // namespace pocd

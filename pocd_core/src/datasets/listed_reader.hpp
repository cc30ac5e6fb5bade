// A reader that knows all its frames before it reads the first one.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "pocd/common/check.hpp"
#include "pocd/input/dataset_reader.hpp"

namespace pocd {

/// `Entry`: what the listing says of a frame.
template <class Entry>
class ListedReader : public DatasetReader {
 public:
  std::size_t size() const override { return entries_.size(); }

  std::optional<Frame> next() override {
    while (next_ < entries_.size()) {
      const std::size_t index = next_++;
      try {
        Frame frame = read(index);
        frame.sequence = index;
        return frame;
      } catch (const InputError& error) {
        skip(error.what());
      }
    }
    return std::nullopt;
  }

 protected:
  explicit ListedReader(double frame_rate_hz) : period_ns_(std::llround(1e9 / frame_rate_hz)) {}

  /// Throws InputError when the frame cannot be used.
  virtual Frame read(std::size_t index) = 0;
  /// For sources without stamps.
  StampNs stamp_ns(std::size_t index) const { return static_cast<StampNs>(index) * period_ns_; }

  const StampNs period_ns_;
  std::vector<Entry> entries_;

 private:
  std::size_t next_ = 0;
};

}  // namespace pocd

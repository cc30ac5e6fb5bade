#include "live_frames.hpp"

#include <algorithm>

#include "pocd/common/check.hpp"
#include "pocd/recording/cdr.hpp"
#include "pocd/recording/recording_reader.hpp"

namespace pocd::recording {
namespace {

constexpr char kTopic[] = "pocd/frames";
// Frames held for one that is missing; the component's own order never strays this far.
constexpr std::size_t kMostWaiting = 128;

}  // namespace

FrameRecord decode_frame_record(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  FrameRecord record;
  const auto seconds = in.number<std::int32_t>();
  record.stamp_ns = StampNs{seconds} * 1'000'000'000 + in.number<std::uint32_t>();
  record.robot = in.string();
  record.epoch = in.number<std::uint64_t>();
  record.order = in.number<std::uint64_t>();
  record.outcome = in.number<std::uint8_t>();
  record.with_segmentation = in.boolean();
  record.with_color = in.boolean();
  return record;
}

LiveFrames::LiveFrames(const std::vector<std::filesystem::path>& files) {
  std::optional<std::uint64_t> epoch;
  std::uint64_t records = 0;
  for (const auto& file : files) {
    const auto reader = open_recording(file);
    reader->select([](const RecordedChannel& channel) { return channel.topic == kTopic; });
    RecordedMessage message;
    for (reader->seek(0); reader->next(message);) {
      FrameRecord record;
      try {
        record = decode_frame_record(message.data, message.size);
      } catch (const DamagedData& damage) {
        throw InputError(file.string() + ": " + kTopic + ": " + damage.what());
      }
      if (!epoch) epoch = record.epoch;
      if (record.epoch != *epoch) continue;
      ++records;
      if (record.outcome == 0) order_.push_back(std::move(record));
    }
  }
  if (records == 0) {
    throw InputError(files.front().string() + ": holds no topic " + kTopic +
                     ", which says what the component took");
  }
  std::stable_sort(order_.begin(), order_.end(),
                   [](const FrameRecord& a, const FrameRecord& b) { return a.order < b.order; });
  for (const FrameRecord& record : order_) listed_[{record.robot, record.stamp_ns}] = true;
}

void LiveFrames::add(Frame frame) {
  const Key key{frame.robot, frame.stamp_ns};
  if (listed_.count(key) > 0) waiting_.emplace(key, std::move(frame));
}

std::optional<Frame> LiveFrames::take() {
  if (order_.empty()) return std::nullopt;
  const auto found = waiting_.find({order_.front().robot, order_.front().stamp_ns});
  if (found == waiting_.end()) {
    return waiting_.size() > kMostWaiting ? take_last() : std::nullopt;
  }
  Frame frame = std::move(found->second);
  waiting_.erase(found);
  if (!order_.front().with_segmentation) frame.labels = cv::Mat();
  if (!order_.front().with_color) frame.color = cv::Mat();
  order_.pop_front();
  return frame;
}

std::optional<Frame> LiveFrames::take_last() {
  while (!order_.empty() && waiting_.count({order_.front().robot, order_.front().stamp_ns}) == 0) {
    ++missing_;
    order_.pop_front();
  }
  return order_.empty() ? std::nullopt : take();
}

}  // namespace pocd::recording

#include "pocd_dds/segment/segmenter.hpp"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <opencv2/core.hpp>
#include <thread>

#include "pocd/common/check.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/node/input_delivery.hpp"
#include "pocd_dds/node/robot_input.hpp"

namespace pocd::dds {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kIdle{100};
constexpr std::chrono::seconds kReport{60};
// Whoever announces a colour image is a robot; each takes readers and memory.
constexpr std::size_t kMostRobots = 200;

// As pocd_play sends images: matches reliable and best-effort readers.
constexpr Delivery kMasks{true, false, 5, 0, 0, false, 0};
constexpr Delivery kLossless{true, false, 0, 64, 0, false, 0};

InputConfig colours_of(InputConfig input) {
  input.color = StreamUse::kRequired;
  input.segmentation = StreamUse::kOptional;  // to notice that masks come from elsewhere
  return input;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

class Segmenter::Robot {
 public:
  struct Image {
    StampNs stamp_ns = 0;
    std::string frame;
    cv::Mat color;
  };

  Robot(const std::shared_ptr<Participant>& participant,
        const std::shared_ptr<Participant>& masks_participant, const InputConfig& input,
        const RobotConfig& config, bool lossless, bool is_named, Wakeup& wakeup)
      : named(is_named),
        masks(masks_participant, topics::kSegmentation,
              topic_of(input, config, InputStream::kSegmentation), lossless ? kLossless : kMasks),
        colors(participant, InputStream::kColor, topic_of(input, config, InputStream::kColor),
               lossless, wakeup) {}

  const bool named;
  Writer<sensor_msgs::msg::ImagePubSubType> masks;
  ImageReader colors;
  std::optional<Image> waiting;
  std::uint64_t told_lost = 0;
};

Segmenter::Segmenter(const SegmenterOptions& options, std::shared_ptr<SegmentationNetwork> network)
    : options_(options), topics_(colours_of(options.input)), network_(std::move(network)) {
  BusOptions bus = options.bus;
  bus.listener = &watch_;
  participant_ = std::make_shared<Participant>(bus);
  masks_participant_ = std::make_shared<Participant>(options.bus);
  for (const RobotConfig& robot : options.input.robots) meet(robot, true);
  watch_.set_wake([this] { taker_.wake(); });
}

Segmenter::~Segmenter() { watch_.set_wake(nullptr); }

void Segmenter::meet(const RobotConfig& config, bool named) {
  robots_[config.name] = std::make_shared<Robot>(participant_, masks_participant_, options_.input,
                                                 config, options_.lossless, named, taker_);
}

bool Segmenter::is_ours(const ParticipantKey& participant) const {
  for (const auto& own : {participant_, masks_participant_}) {
    if (std::equal(participant.begin(), participant.end(), own->get()->guid().guidPrefix.value)) {
      return true;
    }
  }
  return false;
}

void Segmenter::follow_bus() {
  for (const BusEvent& event : watch_.take()) {
    if (event.kind != BusEvent::Kind::kEndpoint || !event.endpoint.writer) continue;
    const BusEndpoint& endpoint = event.endpoint;
    for (const InputTopic& to : topics_.find(endpoint.topic)) {
      if (to.stream == InputStream::kSegmentation && !is_ours(event.participant)) {
        problems_.count(endpoint.topic, "two_sources",
                        "somebody else sends masks, too: a depth image may get either", 1);
      }
      if (to.stream != InputStream::kColor || robots_.count(to.robot) > 0) continue;
      if (robots_.size() >= kMostRobots) {
        problems_.count(endpoint.topic, "too_many_robots",
                        "there are " + std::to_string(kMostRobots) + " already: no masks", 1);
        continue;
      }
      RobotConfig config;
      config.name = to.robot;
      try {
        meet(config, false);
      } catch (const InputError& error) {
        robots_.erase(to.robot);
        problems_.count(endpoint.topic, "no_reader", error.what(), 1);
        continue;
      }
      spdlog::info("{}: is on the bus", to.robot);
    }
  }
}

void Segmenter::take_until(const std::atomic<bool>& stop) {
  pthread_setname_np(pthread_self(), "pocd_take");
  while (!stop) {
    taker_.wait_for(kIdle);
    const std::lock_guard<std::mutex> lock(mutex_);
    follow_bus();
    for (auto it = robots_.begin(); it != robots_.end();) {
      Robot& robot = *it->second;
      const std::string& topic = robot.colors.topic();
      problems_.count_incompatible(robot.colors);
      const std::uint64_t lost = robot.colors.lost();
      problems_.count(topic, "images_lost", "images did not arrive whole, or found no room",
                      lost - robot.told_lost);
      robot.told_lost = lost;
      // Without loss, an image stays with its reader while another one waits here.
      ImageVisit visit{[&](const recording::RosImage& message) {
        ++counts_.images;
        Checked<cv::Mat> color = color_image(view_of(message));
        if (color.problem) {
          ++counts_.refused;
          problems_.count(topic, *color.problem);
          return;
        }
        if (robot.waiting) {
          ++counts_.dropped;
          problems_.count(topic, "images_dropped",
                          "a newer one came while the network was busy: it is slower than the "
                          "camera",
                          1);
        }
        robot.waiting =
            Robot::Image{message.header.stamp_ns, message.header.frame_id, std::move(*color.value)};
      }};
      SampleMeta meta;
      while (!(options_.lossless && robot.waiting) && robot.colors.take(visit, meta)) {
        visit.rethrow();
      }
      problems_.count_damaged(robot.colors);
      if (robot.waiting) worker_.wake();
      const bool gone = !robot.named && robot.colors.ever_matched() > 0 &&
                        robot.colors.matched() == 0 && !robot.waiting;
      if (gone) spdlog::info("{}: has gone", it->first);
      it = gone ? robots_.erase(it) : std::next(it);
    }
  }
}

std::shared_ptr<Segmenter::Robot> Segmenter::next_with_image() {
  auto at = robots_.upper_bound(last_);
  for (std::size_t i = 0; i < robots_.size(); ++i, ++at) {
    if (at == robots_.end()) at = robots_.begin();
    if (!at->second->waiting) continue;
    last_ = at->first;
    return at->second;
  }
  return nullptr;
}

void Segmenter::label(Robot& robot, const std::atomic<bool>& stop) {
  std::unique_lock<std::mutex> lock(mutex_);
  const Robot::Image image = std::move(*robot.waiting);
  robot.waiting.reset();
  lock.unlock();
  taker_.wake();

  const auto start = Clock::now();
  cv::Mat labels;
  try {
    labels = network_->labels(image.color);
  } catch (const InputError& error) {
    lock.lock();
    ++counts_.refused;
    problems_.count(robot.colors.topic(), "network_failed", error.what(), 1);
    return;
  }
  double largest = 0.0;
  cv::minMaxLoc(labels, nullptr, &largest);
  if (largest < 256) labels.convertTo(labels, CV_8U);
  auto message =
      image_message(labels, largest < 256 ? "mono8" : "mono16", image.stamp_ns, image.frame);
  const bool sent = robot.masks.write(message);
  const double busy_s = seconds_since(start);
  while (options_.lossless && !stop && !robot.masks.wait_acknowledged(kIdle)) {
  }
  lock.lock();
  counts_.busy_s += busy_s;
  counts_.masks += sent;
}

SegmenterCounts Segmenter::run(const std::atomic<bool>& stop) {
  std::exception_ptr failure;
  std::atomic<bool> ending{false};
  std::thread taker([&] {
    try {
      take_until(ending);
    } catch (...) {
      failure = std::current_exception();
      ending = true;
    }
  });
  auto reported = Clock::now();
  try {
    while (!stop && !ending) {
      std::shared_ptr<Robot> robot;
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        robot = next_with_image();
        if (Clock::now() - reported > kReport) {
          reported = Clock::now();
          spdlog::info("{} masks sent of {} images, {} dropped, {} refused", counts_.masks,
                       counts_.images, counts_.dropped, counts_.refused);
        }
      }
      if (robot) {
        label(*robot, stop);
      } else {
        worker_.wait_for(kIdle);
      }
    }
  } catch (...) {
    failure = std::current_exception();
  }
  ending = true;
  taker_.wake();
  taker.join();
  if (failure) std::rethrow_exception(failure);
  return counts_;
}

}  // namespace pocd::dds

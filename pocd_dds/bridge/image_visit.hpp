// sensor_msgs/Image and CompressedImage for a subscriber that converts it where it lies, in the
// middleware's memory.
#pragma once

#include <exception>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <utility>

#include "pocd/recording/ros_messages.hpp"

namespace pocd::dds {

/// The "sample" of such a reader: take() calls `use` with views that end with the call.
struct ImageVisit {
  std::function<void(const recording::RosImage&)> use;
  /// What `use` has thrown: a mistake of ours and not of the sender, whose payload is good. For the
  /// one who takes to throw again; it cannot pass through the middleware.
  std::exception_ptr failure = nullptr;

  void rethrow() {
    if (failure) std::rethrow_exception(std::exchange(failure, nullptr));
  }
};

/// Has the name of the type and reads its payloads; cannot write any.
class ImageVisitType : public eprosima::fastdds::dds::TopicDataType {
 public:
  using type = ImageVisit;

  ImageVisitType() : ImageVisitType(false) {}
  /// False, without a call of `use`, for a payload that is no image.
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override;

  bool serialize(void*, eprosima::fastrtps::rtps::SerializedPayload_t*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override;
  void* createData() override { return new ImageVisit; }
  void deleteData(void* data) override { delete static_cast<ImageVisit*>(data); }
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }

 protected:
  explicit ImageVisitType(bool compressed);

 private:
  const bool compressed_;
};

/// The same of sensor_msgs/CompressedImage.
class CompressedImageVisitType : public ImageVisitType {
 public:
  CompressedImageVisitType() : ImageVisitType(true) {}
};

}  // namespace pocd::dds

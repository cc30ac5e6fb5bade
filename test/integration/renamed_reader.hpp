// A reader of samples that have another name on the bus than the generated type support gives them.
#pragma once

#include "pocd_dds/entities/reader.hpp"

namespace pocd {

/// Without a key, as a reader of ROS 2.
template <class PubSubType>
class RenamedReader : public dds::RawReader {
 public:
  RenamedReader(const std::shared_ptr<dds::Participant>& bus, const dds::TopicSpec& spec,
                dds::Wakeup& wakeup, const std::string& topic = "")
      : RawReader(bus, spec, topic.empty() ? spec.name : topic,
                  eprosima::fastdds::dds::TypeSupport(new dds::RenamedType<PubSubType>(spec.type)),
                  spec.delivery, wakeup) {}
  bool take(typename PubSubType::type& sample, dds::SampleMeta& meta) {
    return take_raw(&sample, meta);
  }
};

}  // namespace pocd

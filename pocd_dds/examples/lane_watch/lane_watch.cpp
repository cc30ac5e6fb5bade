// A fleet manager's view of one lane: says what comes to stand on it, and when it is free again.
// usage: lane_watch DOMAIN WIDTH X1 Y1 X2 Y2 [X3 Y3 ...]   in metres of the map frame; runs until
// it is killed
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <map>
#include <vector>

#include "pocd_msgsPubSubTypes.h"
using namespace eprosima::fastdds::dds;

struct Lane {
  double width = 0.0;
  std::vector<double> xy;  // x and y of the points that it leads through
  bool has(const pocd_msgs::msg::OrientedBox& box) const {
    double nearest = INFINITY;
    for (std::size_t i = 0; i + 3 < xy.size(); i += 2) {
      const double dx = xy[i + 2] - xy[i], dy = xy[i + 3] - xy[i + 1];
      const double px = box.position().x() - xy[i], py = box.position().y() - xy[i + 1];
      const double t =
          std::clamp((px * dx + py * dy) / std::max(dx * dx + dy * dy, 1e-9), 0.0, 1.0);
      nearest = std::min(nearest, std::hypot(px - t * dx, py - t * dy));
    }
    return nearest < 0.5 * (width + std::hypot(box.size().x(), box.size().y()));
  }
};

template <class Type>
DataReader* make_reader(DomainParticipant* bus, const char* name, bool latched) {
  TypeSupport type(new Type());
  type.register_type(bus);
  DataReaderQos qos = DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  qos.history().kind = KEEP_ALL_HISTORY_QOS;  // no dispose takes the place of a state not read yet
  qos.resource_limits().max_samples = qos.resource_limits().max_instances = 0;  // no bound; the
  qos.resource_limits().max_samples_per_instance = 0;  // default is 10 objects
  return bus->create_subscriber(SUBSCRIBER_QOS_DEFAULT)
      ->create_datareader(bus->create_topic(name, type.get_type_name(), TOPIC_QOS_DEFAULT), qos);
}

int main(int argc, char** argv) {
  Lane lane;
  for (int i = 2; i < argc; ++i)
    (i == 2 ? lane.width : lane.xy.emplace_back()) = std::atof(argv[i]);
  if (lane.xy.size() < 4 || lane.xy.size() % 2 != 0) return 2;
  auto* bus = DomainParticipantFactory::get_instance()->create_participant(std::atoi(argv[1]),
                                                                           PARTICIPANT_QOS_DEFAULT);
  if (bus == nullptr) return 1;
  auto* objects = make_reader<pocd_msgs::msg::ObjectStatePubSubType>(bus, "pocd/objects", true);
  auto* events =
      make_reader<pocd_msgs::msg::ObjectEventPubSubType>(bus, "pocd/object_events", false);
  std::map<InstanceHandle_t, unsigned> on_lane;  // a dispose carries no fields, but the same handle
  pocd_msgs::msg::ObjectState object;
  pocd_msgs::msg::ObjectEvent event;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  for (SampleInfo info;; objects->wait_for_unread_message({0, 100'000'000})) {
    while (objects->take_next_sample(&object, &info) == ReturnCode_t::RETCODE_OK) {
      const bool gone = info.instance_state == NOT_ALIVE_DISPOSED_INSTANCE_STATE;
      if (!info.valid_data && !gone) continue;  // the component has gone, not the object
      const bool blocks = !gone && lane.has(object.box());
      const auto known = on_lane.find(info.instance_handle);
      if (blocks && known == on_lane.end()) {
        on_lane[info.instance_handle] = object.local_id();
        std::printf("blocked by %s %u\n", object.class_name().c_str(), object.local_id());
      } else if (!blocks && known != on_lane.end()) {
        std::printf("no longer blocked by %u, %zu left\n", known->second, on_lane.size() - 1);
        on_lane.erase(known);
      }
    }
    while (events->take_next_sample(&event, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data || event.kind() == 1 || !lane.has(event.box())) continue;
      static const char* const kinds[] = {"added", "updated", "moved", "removed"};
      std::printf("%s: %u, because %s\n", kinds[event.kind() & 3], event.local_id(),
                  event.evidence().rule().c_str());
    }
  }
}

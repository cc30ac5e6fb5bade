// The component as a node in the graph of ROS 2.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "pocd/config/node_config.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "rmw_dds_commonPubSubTypes.h"

namespace pocd::dds {

/// Says on ros_discovery_info which topics of ROS 2 the participant's readers and writers are of,
/// under the name `outputs.ros_node`. Not thread-safe.
class RosGraph {
 public:
  /// What ROS 2 looks for in a participant's user data: "" without a name.
  static std::string user_data(const RosOutputConfig& outputs);

  /// Does nothing without a name.
  RosGraph(std::shared_ptr<Participant> participant, const RosOutputConfig& outputs);

  /// Says it again when readers or writers have come or gone.
  void update();
  std::uint64_t failures() const;

 private:
  template <class Info, class Gid, class AnyWriter>
  bool say(AnyWriter& writer);

  const std::shared_ptr<Participant> participant_;
  std::string namespace_, name_;
  std::map<Participant::Guid, bool> said_;  // true: a reader
  // One of the two, or none.
  std::unique_ptr<Writer<rmw_dds_common::msg::ParticipantEntitiesInfoPubSubType>> writer_;
  std::unique_ptr<RenamedWriter<rmw_dds_common::msg::ParticipantEntitiesInfoHumblePubSubType>>
      humble_writer_;
};

}  // namespace pocd::dds

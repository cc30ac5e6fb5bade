#include "pocd_dds/node/ros_graph.hpp"

#include <algorithm>
#include <utility>

namespace pocd::dds {
namespace {

template <class Gid>
Gid gid_of(const Participant::Guid& guid) {
  Gid gid;
  std::copy(guid.begin(), guid.end(), gid.data().begin());  // a longer one ends with zeros
  return gid;
}

}  // namespace

std::string RosGraph::user_data(const RosOutputConfig& outputs) {
  return outputs.ros_node.empty() ? "" : "enclave=/;";
}

RosGraph::RosGraph(std::shared_ptr<Participant> participant, const RosOutputConfig& outputs)
    : participant_(std::move(participant)) {
  if (outputs.ros_node.empty()) return;
  const std::size_t slash = outputs.ros_node.rfind('/');
  name_ = outputs.ros_node.substr(slash == std::string::npos ? 0 : slash + 1);
  namespace_ = slash == std::string::npos ? "" : outputs.ros_node.substr(0, slash);
  if (namespace_.empty() || namespace_[0] != '/') namespace_ = "/" + namespace_;
  if (outputs.ros_release == RosRelease::kHumble) {
    humble_writer_ = std::make_unique<decltype(humble_writer_)::element_type>(
        participant_, topics::kRosGraph, topics::kRosGraph.name);
  } else {
    writer_ = std::make_unique<decltype(writer_)::element_type>(participant_, topics::kRosGraph);
  }
}

template <class Info, class Gid, class AnyWriter>
bool RosGraph::say(AnyWriter& writer) {
  Info info;
  info.gid(gid_of<Gid>(to_guid(participant_->get()->get_instance_handle())));
  auto& node = info.node_entities_info_seq().emplace_back();
  node.node_namespace(namespace_);
  node.node_name(name_);
  for (const auto& [guid, reads] : said_) {
    (reads ? node.reader_gid_seq() : node.writer_gid_seq()).push_back(gid_of<Gid>(guid));
  }
  return writer.write(info);
}

void RosGraph::update() {
  if (!writer_ && !humble_writer_) return;
  std::map<Participant::Guid, bool> now;
  for (const auto& [guid, endpoint] : participant_->endpoints()) {
    if (endpoint.topic.rfind("rt/", 0) == 0) now[guid] = endpoint.reads;
  }
  if (now == said_) return;
  said_ = std::move(now);
  using rmw_dds_common::msg::Gid;
  using rmw_dds_common::msg::GidHumble;
  using rmw_dds_common::msg::ParticipantEntitiesInfo;
  using rmw_dds_common::msg::ParticipantEntitiesInfoHumble;
  const bool written = writer_ ? say<ParticipantEntitiesInfo, Gid>(*writer_)
                               : say<ParticipantEntitiesInfoHumble, GidHumble>(*humble_writer_);
  if (!written) said_.clear();
}

std::uint64_t RosGraph::failures() const {
  return (writer_ ? writer_->failures() : 0) + (humble_writer_ ? humble_writer_->failures() : 0);
}

}  // namespace pocd::dds

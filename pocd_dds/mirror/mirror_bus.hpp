// The readers and the writer of a mirror.
#pragma once

#include <initializer_list>
#include <memory>
#include <utility>

#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "pocd_dds/entities/writer.hpp"
#include "pocd_dds/map_mirror.hpp"
#include "pocd_msgsPubSubTypes.h"

namespace pocd::dds {

/// The table's bound is that of a writer; others may publish their objects on the topic, too.
inline Delivery objects_of_all_maps() {
  Delivery delivery = topics::kObjects.delivery;
  delivery.max_instances = 0;
  return delivery;
}

/// What a mirror has on the bus. It goes and comes as a whole.
struct MirrorBus {
  MirrorBus(std::shared_ptr<Participant> of, const MirrorOptions& options, Wakeup& wakeup)
      : participant(std::move(of)),
        manifests(participant, topics::kMapManifest, wakeup),
        deltas(participant, topics::kMapDeltas, wakeup),
        object_states(participant, topics::kObjects, topics::kObjects.name, objects_of_all_maps(),
                      wakeup),
        events(participant, topics::kObjectEvents, wakeup),
        requests(participant, topics::kSnapshotRequest),
        look_states(options.looks ? std::make_unique<Reader<pocd_msgs::msg::MapLooksPubSubType>>(
                                        participant, topics::kMapLooks, wakeup)
                                  : nullptr) {}

  /// What its readers could not read since the last call.
  void count_damaged(ProblemCounter& problems) {
    for (RawReader* reader :
         std::initializer_list<RawReader*>{&manifests, &deltas, &object_states, &events,
                                           look_states.get(), replies.get(), tiles.get()}) {
      if (reader != nullptr) problems.count_damaged(*reader);
    }
  }

  std::shared_ptr<Participant> participant;
  Reader<pocd_msgs::msg::MapManifestPubSubType> manifests;
  Reader<pocd_msgs::msg::MapDeltaPubSubType> deltas;
  Reader<pocd_msgs::msg::ObjectStatePubSubType> object_states;
  Reader<pocd_msgs::msg::ObjectEventPubSubType> events;
  Writer<pocd_msgs::msg::MapSnapshotRequestPubSubType> requests;
  std::unique_ptr<Reader<pocd_msgs::msg::MapLooksPubSubType>> look_states;  // null: not wanted
  // Only while snapshots are waited for, or tiles are gathered.
  std::unique_ptr<Reader<pocd_msgs::msg::MapSnapshotReplyPubSubType>> replies;
  std::unique_ptr<Reader<pocd_msgs::msg::MapTilePubSubType>> tiles;
};

}  // namespace pocd::dds

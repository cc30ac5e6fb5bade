// ObjectTracker: what an operator says of objects.
#include "object_tracker.hpp"
#include "pocd/common/check.hpp"

namespace pocd {
namespace {

ObjectEvent event_of(EventKind kind, const ObjectTracker::Said& said, std::uint64_t sequence) {
  ObjectEvent event;
  event.sequence = sequence;
  event.kind = kind;
  event.stamp_ns = said.stamp_ns;
  event.evidence.rule = said.rule;
  event.by = said.by;
  return event;
}

}  // namespace

void ObjectTracker::forget(ObjectId id, const Said& said, MapEdits& edits, FrameResult& result) {
  const LibraryObject* object = library_.find(id);
  POCD_CHECK(object);
  if (object->confirmed) {
    ObjectEvent event = event_of(EventKind::kOperator, said, next_event_++);
    event.object = id;
    event.class_id = object->class_id;
    event.box = object->box;
    result.events.push_back(std::move(event));
    result.retired.push_back(id);
  }
  edits.clear(id);
  library_.erase(id);
}

void ObjectTracker::confirm_removal(ObjectId id, const Said& said, MapEdits& edits,
                                    FrameResult& result) {
  const LibraryObject* object = library_.find(id);
  POCD_CHECK(object && object->confirmed);
  ObjectEvent event = event_of(EventKind::kRemoved, said, next_event_++);
  event.object = id;
  event.class_id = object->class_id;
  event.box = object->box;
  event.evidence.stationarity_class = object->stationarity_class;
  event.evidence.before = event.evidence.after = object->belief;
  event.last_there_ns = object->in_place_ns;
  Departure departure;
  departure.id = id;
  departure.class_id = object->class_id;
  departure.box = object->box;
  departure.surfels = object->model.surfels();
  departure.first_seen_ns = object->first_seen_ns;
  departure.in_place_ns = object->in_place_ns;
  departure.departed_ns = said.stamp_ns;
  departure.seen_by = object->seen_by;
  departure.evidence = event.evidence;
  result.events.push_back(std::move(event));
  result.retired.push_back(id);
  edits.clear(id);
  library_.erase(id);
  keep(std::move(departure), result);
}

void ObjectTracker::note(const Said& said, const OrientedBox& where, FrameResult& result) {
  ObjectEvent event = event_of(EventKind::kOperator, said, next_event_++);
  event.box = where;
  result.events.push_back(std::move(event));
}

void ObjectTracker::forget_places(const std::function<bool(const Eigen::Vector2d&)>& inside) {
  departures_.forget_where(inside);
  free_space_.forget_where(inside);
}

}  // namespace pocd

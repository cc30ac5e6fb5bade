#include "mirror/object_copy.hpp"

#include <iterator>

#include "pocd_dds/bridge/object_messages.hpp"

namespace pocd::dds {
namespace {

namespace msg = pocd_msgs::msg;

bool is_of(const msg::ObjectState& object, const msg::MapManifest* manifest) {
  return manifest == nullptr || object.epoch() == manifest->epoch() ||
         object.lineage() == manifest->lineage();
}

template <class Objects, class Condition>
void erase_if(Objects& objects, const Condition& condition) {
  for (auto object = objects.begin(); object != objects.end();) {
    object = condition(*object) ? objects.erase(object) : std::next(object);
  }
}

}  // namespace

void ObjectCopy::take(Reader<msg::ObjectStatePubSubType>& reader, int most) {
  reader.take_some(most, [&](const msg::ObjectState& state, const SampleMeta& meta) {
    if (meta.valid) {
      if (state.map_id() != map_id_) return;
      heard_before_.erase(state.uuid());
      if (state.forgotten()) {
        objects_.erase(state.uuid());
      } else {
        objects_[state.uuid()] = state;
      }
    } else if (meta.disposed) {
      objects_.erase(meta.key);
    }
  });
}

void ObjectCopy::settle(const msg::MapManifest& manifest) {
  if (epoch_ != 0 && epoch_ != manifest.epoch() && lineage_ != manifest.lineage()) {
    erase_if(objects_, [&](const auto& entry) { return entry.second.epoch() == epoch_; });
  }
  epoch_ = manifest.epoch();
  lineage_ = manifest.lineage();
  std::size_t told = 0;
  const auto is_told = [&](const auto& entry) {
    return entry.second.epoch() == epoch_ && heard_before_.count(entry.first) == 0;
  };
  for (const auto& entry : objects_) told += is_told(entry);
  if (told == objects_.size() || told < manifest.object_count()) return;
  erase_if(objects_, [&](const auto& entry) {
    return entry.second.lineage() == lineage_ && !is_told(entry);
  });
  heard_before_.clear();
}

void ObjectCopy::begin_anew() {
  for (const auto& entry : objects_) heard_before_.insert(entry.first);
}

std::size_t ObjectCopy::count(const msg::MapManifest* manifest) const {
  std::size_t count = 0;
  for (const auto& entry : objects_) count += is_of(entry.second, manifest);
  return count;
}

void ObjectCopy::add_to(MirrorContents& contents, const msg::MapManifest* manifest) const {
  for (const auto& [key, state] : objects_) {
    if (!is_of(state, manifest)) continue;
    contents.objects.push_back(object_from(state));
    contents.class_names[state.class_id()] = state.class_name();
  }
}

}  // namespace pocd::dds

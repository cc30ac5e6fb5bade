// What happened to the objects, as far as it was heard: for the time line.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pocd_dds/object_watch.hpp"

namespace pocd::view {

/// How an object was, from a stamp on.
struct ObjectSample {
  StampNs stamp_ns = 0;
  OrientedBox box;
  Belief belief;
  std::uint32_t observations = 0;
};

/// All stamps are of the data. An object's past is thinned when it becomes long: what is old is
/// known less densely, the first and the last sample always. Of too many objects, those that went
/// first are forgotten first. Not thread-safe.
class History {
 public:
  static constexpr std::size_t kMostSamples = 512;    ///< per object
  static constexpr std::size_t kMostObjects = 20000;  ///< as many as a publisher can have

  struct Record {
    std::string class_name;
    std::uint32_t number = 0;  ///< within its run
    std::uint32_t run = 0;
    int stationarity_class = 0;
    StampNs first_ns = 0;  ///< it was first seen
    std::optional<StampNs> gone_ns;
    std::deque<ObjectSample> samples;  ///< by stamp, never empty
  };

  /// `now_ns`: the newest stamp heard of; a state that says nothing new is not kept.
  void state(const std::string& uuid, const WatchedObject& object, std::uint32_t run,
             StampNs now_ns);
  /// What a log says of before: an object as it was at `sample`'s stamp, or (`gone`) that it went
  /// then. `object` is how it is named.
  void logged(const std::string& uuid, const WatchedObject& object, std::uint32_t run,
              const ObjectSample& sample, bool gone);
  void gone(const std::string& uuid, StampNs now_ns);

  const Record* find(const std::string& uuid) const;
  /// Those that were there at the stamp, with how they were: the last sample not after it.
  std::vector<std::pair<std::string, ObjectSample>> at(StampNs stamp_ns) const;
  std::size_t size() const { return records_.size(); }

 private:
  void forget_departed();

  std::map<std::string, Record> records_;
  std::deque<std::string> departed_;  // in the order of going
};

}  // namespace pocd::view

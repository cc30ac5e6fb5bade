// What stands where and what happened to it, for a fleet manager. No DDS type shows here.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "pocd/objects/frame_result.hpp"
#include "pocd_dds/callbacks.hpp"

namespace pocd {

struct WatchedObject {
  std::array<std::uint8_t, 16> uuid{};  ///< never used twice, by no node
  std::uint64_t epoch = 0;              ///< run of the node that says so
  /// Memory that the node goes on with from run to run: its objects keep their uuids. Without a
  /// memory, the epoch.
  std::uint64_t lineage = 0;
  std::string class_name;
  ObjectSnapshot state;
};

enum class Gone {
  kRemoved,  ///< it was seen that it is not there any more, or it turned out to be another one
  /// Its node was killed or has ended, and a new run that does not know it goes on: one without a
  /// memory, or one whose memory had not kept it yet. Nobody has looked whether it is still there:
  /// its place is unknown and not free.
  kReplaced,
  /// An operator had it forgotten. Its place is unknown and not free.
  kForgotten
};

/// Callbacks may be empty. They are called one at a time, by a thread of the watch, in the order in
/// which the bus gives the samples of a topic; objects and events are two topics. They may be slow
/// and may throw: the status says so, and the next ones are called. The watch's end waits until all
/// that wait were called.
struct ObjectWatchOptions {
  int domain = 0;             ///< 0 .. 232
  std::string profiles_file;  ///< XML profiles of the operator; empty: none
  std::string name = "pocd_object_watch";
  std::string security_folder;  ///< identity and permissions (docs/security.md); empty: no security
  std::uint32_t map_id = 0;     ///< the publisher's `node.map_id`
  /// New, or changed. Who joins late gets all there are.
  std::function<void(const WatchedObject&)> on_object;
  /// With its last state. A node that ends or dies takes no object away: nobody has seen that the
  /// place is free.
  std::function<void(const WatchedObject&, Gone why)> on_gone;
  /// Events from before the watch joined are not repeated.
  std::function<void(const ObjectEvent&, const std::string& class_name)> on_event;
  /// kWait: what the program is too slow for waits at the publisher, which keeps the last state of
  /// each object and 1000 events: of states that follow one another some are left out, but never
  /// the last one, nor that the object is gone. With the other two anything may be dropped.
  CallbackOptions callbacks;
  /// Objects known at a time; of more than these nothing is said, and they are counted. What is on
  /// the bus is the peers' choice.
  std::size_t most_objects = 100000;
};

struct WatchStatus {
  std::size_t objects = 0;     ///< known now
  std::uint64_t too_many = 0;  ///< samples of objects beyond `most_objects`
  std::uint64_t corrupt = 0;   ///< samples that could not be read
  /// Not empty: nothing is heard any more until this process is started anew, and why.
  std::string hangs;
  std::string refused;  ///< whose samples are not read, being of another version of the type
  CallbackStatus callbacks;
  std::uint64_t failures = 0;  ///< turns of the watch's thread that have failed; it goes on
  std::string last_failure;
};

/// Listens with a thread of its own, from construction on.
class ObjectWatch {
 public:
  /// Throws InputError when the bus cannot be used.
  explicit ObjectWatch(const ObjectWatchOptions& options);
  ~ObjectWatch();
  ObjectWatch(const ObjectWatch&) = delete;
  ObjectWatch& operator=(const ObjectWatch&) = delete;

  /// A node that publishes this map is there, whatever other maps there are. False: nobody says
  /// what is there now, and what was heard may be out of date. Thread-safe.
  bool publisher_present() const;
  /// Thread-safe.
  WatchStatus status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd

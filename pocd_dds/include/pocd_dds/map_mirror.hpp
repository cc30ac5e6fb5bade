// A copy of the published map and objects in the process of a subscriber. No DDS type shows here.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pocd/map/map_delta.hpp"
#include "pocd/objects/frame_result.hpp"
#include "pocd_dds/callbacks.hpp"

namespace pocd {

/// How a copy that is behind becomes the publisher's map again.
enum class CatchUp {
  kEither,  ///< from the tiles that the bus keeps for late joiners, or by a snapshot; both if need
            ///< be
  kTiles,   ///< from the tiles only: also from a recording, which answers no request
  kSnapshot,  ///< by asking the publisher only
};

struct MirrorOptions {
  int domain = 0;             ///< 0 .. 232
  std::string profiles_file;  ///< XML profiles of the operator; empty: none
  std::string name = "pocd_mirror";
  std::string security_folder;  ///< identity and permissions (docs/security.md); empty: no security
  std::uint32_t map_id = 0;     ///< the publisher's `node.map_id`
  CatchUp catch_up = CatchUp::kEither;
  bool looks = false;  ///< also when regions were last looked at: MirrorContents::regions
  /// Called for every event in order, by a thread of its own, with the name of the object's class.
  /// Events from before the mirror joined are not repeated. It may be slow and may throw: the copy
  /// goes on, and the status says so. The mirror's end waits until all that wait were called.
  std::function<void(const ObjectEvent&, const std::string& class_name)> on_event;
  /// kWait: the copy waits as well, and is stale meanwhile.
  CallbackOptions callbacks{10000, WhenFull::kDropOldest};
};

struct MirrorStatus {
  /// The copy equals the published map at the newest version heard of, proven by the digest, and
  /// the publisher is there or has ended its run in order.
  bool in_step = false;
  std::string stale_because;  ///< empty when in step
  std::uint64_t epoch = 0;    ///< run of the publisher; 0: none heard of
  std::uint64_t version = 0;  ///< of the copy
  MapDigest digest;           ///< of the copy
  std::size_t tiles = 0;
  std::size_t objects = 0;
  bool publisher_present = false;
  /// Nodes that say they publish this map. More than one: the copy follows the first and is stale.
  std::size_t publishers = 0;
  bool publisher_seen = false;  ///< at any time
  bool final_version = false;   ///< the publisher has ended its run in order, at this version
  std::uint64_t deltas = 0, gaps = 0;
  std::uint64_t corrupt = 0;  ///< messages, of any topic, that could not be read or used
  std::uint64_t snapshots_asked = 0, snapshots_taken = 0;
  std::uint64_t gathered = 0;  ///< times that the copy was made of single tiles
  CallbackStatus callbacks;
  /// Turns of the mirror's thread that have failed, with the text of the last failure. The thread
  /// goes on, and what it has missed is made up like anything else that is missing.
  std::uint64_t failures = 0;
  std::string last_failure;
};

/// A region of the map, a cube of 64 voxels that begins at `region` * 64 * voxel_size_m, in which a
/// robot has measured a surface.
struct MirrorRegion {
  BlockKey region;
  StampNs last_looked_ns = 0;  ///< stamp of the last frame that did
  bool looked_in_run = false;  ///< false: nobody has looked since the publisher was started
};

struct MirrorContents {
  MirrorStatus status;
  double voxel_size_m = 0.0;
  double truncation_m = 0.0;
  std::string frame_id;
  std::map<TileKey, MapTile> tiles;
  std::vector<ObjectSnapshot> objects;         ///< by id
  std::map<ClassId, std::string> class_names;  ///< of the objects
  /// By z, y, x; with MirrorOptions::looks, of a publisher with a memory, up to 5 s late.
  std::vector<MirrorRegion> regions;
};

/// Follows the deltas with a thread of its own, from construction on. When it joins late, has
/// missed something, or the publisher has started anew, it catches up as CatchUp says. Thread-safe.
class MapMirror {
 public:
  /// Throws InputError when the bus cannot be used.
  explicit MapMirror(const MirrorOptions& options);
  ~MapMirror();
  MapMirror(const MapMirror&) = delete;
  MapMirror& operator=(const MapMirror&) = delete;

  MirrorStatus status() const;
  MirrorContents contents() const;
  /// Waits until `condition` holds (called after every change, with the status). False: timed out.
  bool wait_until(const std::function<bool(const MirrorStatus&)>& condition,
                  std::chrono::milliseconds time) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd

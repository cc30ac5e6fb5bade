// What was seen empty, and when: thumbnails of earlier views.
#pragma once

#include <cstdint>
#include <set>
#include <unordered_map>
#include <vector>

#include "pocd/segmentation/organized_cloud.hpp"

namespace pocd {

/// Something new in a place that was seen empty before has arrived; in a place that was never seen
/// it may always have been there. Keeps a few small depth images per place and heading (about 2 KB
/// per view), so memory follows the ground that was driven over, not time. Not thread-safe.
class ViewMemory {
 public:
  /// Keeps the view unless one from about the same place and heading is newer than `kRenew_ns`.
  void add(const OrganizedCloud& cloud, StampNs stamp_ns);

  /// Share of the points, among those that some kept view before `before_ns` had in its picture
  /// nearer than `max_depth_m`, which at least one such view saw through by more than `margin_m`;
  /// 0 when no point was in any picture. Looks at no more than about 200 points.
  double seen_empty_share(const Points& points_W, StampNs before_ns, double max_depth_m,
                          double margin_m) const;

  /// No view that is kept is newer than `latest_ns` from here on.
  void set_clock_back(StampNs latest_ns);

  std::size_t size() const;

  /// Keys of the places whose views have changed since the last call, for who writes them down;
  /// noted from the first call on.
  std::set<std::uint64_t> take_changed();

 private:
  friend struct ArchiveAccess;
  struct View {
    StampNs stamp_ns = 0;
    Pose T_C_W = Pose::Identity();
    CameraModel camera;            ///< of the thumbnail
    std::vector<float> nearest_m;  ///< per tile; 0 where nothing is known
  };
  static constexpr StampNs kRenew_ns = 10'000'000'000;

  /// Views by place of the camera (cells of half a metre) and heading (octants): the latest, and
  /// one at least kRenew_ns older.
  std::unordered_map<std::uint64_t, std::vector<View>> views_;  ///< looked up, never iterated
  bool notes_changes_ = false;
  std::set<std::uint64_t> changed_;
};

}  // namespace pocd

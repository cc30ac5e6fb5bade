// Regions that an operator has taken out of what is looked at.
#pragma once

#include <map>
#include <string>

#include "pocd/common/polygon.hpp"
#include "pocd/segmentation/organized_cloud.hpp"

namespace pocd {

/// Not thread-safe. Costs nothing while there are none.
class IgnoredRegions {
 public:
  static constexpr std::size_t kMost = 1000;

  void add(const std::string& name, const Polygon& polygon_W) { by_name_[name] = polygon_W; }
  bool remove(const std::string& name) { return by_name_.erase(name) > 0; }
  bool has(const std::string& name) const { return by_name_.count(name) > 0; }
  std::size_t size() const { return by_name_.size(); }

  /// Marks as kIgnore the pixels whose ray, up to the return or to `max_depth_m`, passes through a
  /// region: they say nothing of what is in it, nor of what is behind it.
  void mark(double max_depth_m, ThreadPool& pool, OrganizedCloud& cloud) const;

 private:
  friend struct ArchiveAccess;
  std::map<std::string, Polygon> by_name_;
};

}  // namespace pocd

// The side of an alignment that is prepared once: an object's points and normals in a pyramid of
// cells, for nearest-neighbour queries whose cost does not grow with the number of points.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pocd/common/types.hpp"

namespace pocd {

/// Immutable after construction, so it may be read from several threads.
///
/// Level 0 holds all points in cells of about `inlier_distance_m`; each further level holds one
/// point per cell of the level below, in cells twice as large, up to `max_correspondence_m`. Hence
/// a neighbour within the inlier distance is the exact nearest one, and a farther one is near
/// enough for a point-to-plane residual: its error is below the diagonal of a cell that is no
/// larger than the neighbour's distance.
class IcpTarget {
 public:
  struct Neighbour {
    Eigen::Vector3f point;  ///< relative to origin_W()
    Eigen::Vector3f normal;
    float squared_distance_m2;
  };

  /// `points_W` finite, at least one; `normals_W` of unit length, or zero where unknown: such a
  /// point can be an inlier but constrains no motion. Distances > 0 [m]. Throws std::logic_error
  /// otherwise.
  IcpTarget(const Points& points_W, const Points& normals_W, double inlier_distance_m,
            double max_correspondence_m);

  /// Nearest point within max_correspondence_m() of `query`, given relative to origin_W().
  /// Of equally near points always the same one.
  std::optional<Neighbour> nearest(const Eigen::Vector3f& query) const;
  /// The same within inlier_distance_m(), and faster.
  std::optional<Neighbour> nearest_inlier(const Eigen::Vector3f& query) const;

  /// Corner of the points' bounding box. Coordinates relative to it keep float precision in a large
  /// map.
  const Eigen::Vector3d& origin_W() const { return origin_W_; }
  double inlier_distance_m() const { return inlier_distance_m_; }
  double max_correspondence_m() const { return max_correspondence_m_; }
  std::size_t size() const { return levels_.front().points.size(); }

 private:
  struct Level {
    float cell_m = 0.0f;
    Eigen::Array3i cells;  ///< including a border of two empty cells on every side
    std::vector<std::uint32_t>
        begin;  ///< per cell, x fastest: its first point; one more at the end
    /// Per cell: which of the nine rows of three cells around it have points.
    std::vector<std::uint16_t> rows;
    std::vector<Eigen::Vector3f> points;
    std::vector<Eigen::Vector3f> normals;

    int flat_index(const Eigen::Array3i& cell) const {
      return (cell.z() * cells.y() + cell.y()) * cells.x() + cell.x();
    }
    Eigen::Array3i cell_of(const Eigen::Vector3f& point) const;
    void note_rows();
  };

  static Level make_level(const std::vector<Eigen::Vector3f>& points,
                          const std::vector<Eigen::Vector3f>& normals, float cell_m);
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  /// The nearest point of the level among the cells around the query, if it is nearer than
  /// `nearest2`, which it lowers; else kNone.
  static std::uint32_t search(const Level& level, const Eigen::Vector3f& query, float& nearest2);

  Eigen::Vector3d origin_W_;
  double inlier_distance_m_;
  double max_correspondence_m_;
  std::vector<Level> levels_;
};

}  // namespace pocd

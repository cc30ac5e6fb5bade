// What Rerun's reader of MCAP does not take of ROS 2 messages, in messages that it takes. It reads
// the points of a cloud with all its fields, of which it knows "colors" (RGBA in 32 bits) and
// "radii" [m], grids, transforms and images; no markers, and no odometry.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "pocd/recording/bytes.hpp"
#include "pocd_dds/recording/recorded_topic.hpp"
#include "visualization_msgs.h"

namespace pocd::dds {

/// Of one topic. Not thread-safe.
class RerunForm {
 public:
  /// Nothing for a topic that needs none.
  static std::optional<RerunForm> of(const RecordedTopic& topic);

  /// The schema of a second topic that gets what convert() gives, named by second_name(); nothing:
  /// it takes the place of the message itself.
  std::optional<recording::SchemaText> second() const;
  static std::string second_name(const RecordedTopic& topic);
  /// Of a message in CDR. A cloud with a field "rgb" gets "colors"; boxes among markers become a
  /// cloud of their edges, all that stand; a pose of odometry becomes a transform. Nothing where
  /// there is nothing to convert, or the message is damaged.
  std::optional<recording::Bytes> convert(const recording::Bytes& message);
  /// What convert() has left out so far, by what it was: "markers of type 9 (text)" and so on.
  const std::map<std::string, std::uint64_t>& left_out() const { return left_out_; }

 private:
  enum class Kind { kCloud, kMarkers, kOdometry };
  explicit RerunForm(Kind kind) : kind_(kind) {}
  recording::Bytes edges(const visualization_msgs::msg::MarkerArray& array);

  Kind kind_;
  std::map<std::pair<std::string, std::int32_t>, visualization_msgs::msg::Marker> boxes_;
  std::map<std::string, std::uint64_t> left_out_;
};

}  // namespace pocd::dds

// Follows one map on the bus and puts what there is to see on the board.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "view/board.hpp"
#include "view/robots.hpp"
#include "view/source.hpp"

namespace pocd::view {

struct FeedOptions {
  int domain = 0;                 ///< 0 .. 232
  std::string profiles_file;      ///< XML profiles of the operator; empty: none
  std::string security_folder;    ///< identity and permissions; empty: no security
  std::uint32_t map_id = 0;       ///< the publisher's `node.map_id`
  std::string map_frame = "map";  ///< of the robots' poses: the publisher's `node.map_frame`
  RobotTopics robots;
};

/// Threads of its own, from construction on. Thread-safe.
class Feed : public Source {
 public:
  /// `board` must outlive it. Throws InputError when the bus cannot be used.
  Feed(const FeedOptions& options, Board& board);
  ~Feed() override;
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  std::optional<std::string> history(const std::string& uuid) const override;
  std::string then(double stamp_s) const override;
  /// For readers of single topics.
  std::shared_ptr<dds::Participant> participant() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::view

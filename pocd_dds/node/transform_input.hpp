// Transforms of one tf or tf_static topic, into a tree.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "pocd/input/transform_tree.hpp"
#include "pocd_dds/bridge/input_problem.hpp"
#include "pocd_dds/entities/reader.hpp"
#include "tf2_msgsPubSubTypes.h"

namespace pocd::dds {

/// Both kinds. Used by one thread only.
class TransformInput {
 public:
  /// `wakeup` must outlive it.
  TransformInput(const std::shared_ptr<Participant>& participant, const std::string& tf_topic,
                 const std::string& tf_static_topic, const Delivery& delivery, Wakeup& wakeup);

  /// Puts what has arrived into the tree. The child frames of what moves.
  std::set<std::string> drain(TransformTree& tree, ProblemCounter& problems);
  /// Only what does not move: may be done at any time.
  void drain_static(TransformTree& tree, ProblemCounter& problems) {
    drain(static_, true, tree, problems);
  }

 private:
  using TfReader = Reader<tf2_msgs::msg::TFMessagePubSubType>;
  static std::set<std::string> drain(TfReader& reader, bool is_static, TransformTree& tree,
                                     ProblemCounter& problems);

  TfReader moving_, static_;
};

}  // namespace pocd::dds

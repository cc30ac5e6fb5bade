#include "pocd_dds/node/transform_input.hpp"

#include "pocd/input/robot_streams.hpp"
#include "pocd_dds/bridge/conversions.hpp"

namespace pocd::dds {
namespace {

constexpr int kMostMessages = 1000;  // taken in one turn

}  // namespace

TransformInput::TransformInput(const std::shared_ptr<Participant>& participant,
                               const std::string& tf_topic, const std::string& tf_static_topic,
                               const Delivery& delivery, Wakeup& wakeup)
    : moving_(participant, topics::kTf, tf_topic, delivery, wakeup),
      static_(participant, topics::kTfStatic, tf_static_topic, topics::kTfStatic.delivery, wakeup) {
}

std::set<std::string> TransformInput::drain(TransformTree& tree, ProblemCounter& problems) {
  drain_static(tree, problems);
  return drain(moving_, false, tree, problems);
}

std::set<std::string> TransformInput::drain(TfReader& reader, bool is_static, TransformTree& tree,
                                            ProblemCounter& problems) {
  std::set<std::string> moved;
  problems.count_incompatible(reader);
  reader.take_some(kMostMessages, [&](const auto& message, const SampleMeta& meta) {
    if (!meta.valid) return;
    for (const auto& entry : message.transforms()) {
      const std::string child =
          add_transform(transform_from(entry), is_static, reader.topic(), tree, problems);
      if (!is_static && !child.empty()) moved.insert(child);
    }
  });
  problems.count_damaged(reader);
  return moved;
}

}  // namespace pocd::dds

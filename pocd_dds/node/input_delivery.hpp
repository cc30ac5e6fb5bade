// How the node reads the topics of its input.
#pragma once

#include <string>

#include "pocd/config/node_config.hpp"
#include "pocd/input/input_topics.hpp"
#include "pocd_dds/entities/topic_table.hpp"

namespace pocd::dds {

/// The table's line; with the compressed type for an image topic of that name.
TopicSpec spec_of(InputStream stream, bool compressed = false);
inline TopicSpec spec_of(InputStream stream, const std::string& topic) {
  return spec_of(stream, is_image(stream) && is_compressed_name(topic));
}

/// As the table says or, in a replay without loss, with a history that holds the sender back.
Delivery input_delivery(const TopicSpec& spec, bool lossless);
/// The same for a node; what is small is asked for reliably with node.reliable_tf_and_info.
Delivery input_delivery(const TopicSpec& spec, const NodeConfig& node);

}  // namespace pocd::dds

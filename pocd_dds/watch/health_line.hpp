// How a node is, as pocd_health says it.
#pragma once

#include <string>

#include "pocd_msgs.h"

namespace pocd::dds {

/// One line without its end: what is up or fails, what it waits for, and how far it is.
std::string health_line(const pocd_msgs::msg::NodeHealth& health);

}  // namespace pocd::dds

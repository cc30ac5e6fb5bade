// Topic names with a robot's name in them.
#pragma once

#include <optional>
#include <string>

namespace pocd {

/// `pattern` with every {robot} replaced.
std::string robot_topic(const std::string& pattern, const std::string& robot);

/// The name that stands for every {robot} in `pattern`, "" when there is none in it; nothing when
/// the topic does not fit. A name is never empty and has no '/'.
std::optional<std::string> robot_in(const std::string& pattern, const std::string& topic);

}  // namespace pocd

#include "pocd/network/network_config.hpp"

namespace pocd {

std::vector<std::string> NetworkConfig::inconsistencies() const {
  std::vector<std::string> problems;
  const auto size = [&](const char* name, int value) {
    if (value < 1)
      problems.push_back(std::string(name) + ": " + std::to_string(value) +
                         ", expected what the network was trained with");
  };
  size("input_width_px", input_width_px);
  size("input_height_px", input_height_px);
  if (classes.empty()) problems.push_back("classes: empty, expected a name for each class");
  return problems;
}

}  // namespace pocd

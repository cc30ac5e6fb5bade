#include "pocd/segmentation/things.hpp"

namespace pocd {

void take_for_things(OrganizedCloud& cloud) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.kind[i] == PixelKind::kNone) continue;
    cloud.kind[i] = PixelKind::kObject;
    cloud.label[i] = kThing;
  }
}

}  // namespace pocd

// What is movable, where no masks tell: by shape, support and connection.
#pragma once

#include "pocd/segmentation/organized_cloud.hpp"

namespace pocd {

/// Every pixel with a return becomes an object of class kThing.
void take_for_things(OrganizedCloud& cloud);

}  // namespace pocd

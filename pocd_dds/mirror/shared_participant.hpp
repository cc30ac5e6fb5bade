// One participant for all that a process follows.
#pragma once

#include <memory>
#include <string>

#include "pocd_dds/entities/participant.hpp"

namespace pocd::dds {

/// Those of one process that ask for the same share it: a participant costs far more than its
/// readers. Thread-safe.
std::shared_ptr<Participant> shared_participant(const BusOptions& options);

}  // namespace pocd::dds

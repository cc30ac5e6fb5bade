// One participant for all that a process follows.
#pragma once

#include <memory>
#include <string>

#include "pocd_dds/entities/participant.hpp"

namespace pocd::dds {

/// Those of one process that ask for the same share it: a participant costs far more than its
/// readers. `instead_of` is not shared any more: who is deaf with it gets another one, and so do
/// all that ask from then on. Thread-safe.
std::shared_ptr<Participant> shared_participant(
    const BusOptions& options, const std::shared_ptr<Participant>& instead_of = nullptr);

}  // namespace pocd::dds

// What a participant is to be: transports, discovery and security.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "pocd_dds/entities/participant.hpp"

namespace pocd::dds {

/// Of the options, and of the profiles that the operator gives. Warns of what will lose images.
/// Throws InputError: unreadable profiles, or files of security that are missing.
eprosima::fastdds::dds::DomainParticipantQos participant_qos(const BusOptions& options);

}  // namespace pocd::dds

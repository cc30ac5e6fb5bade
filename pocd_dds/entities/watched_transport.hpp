// Whether Fast DDS still takes what comes from the bus.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <memory>
#include <string>

#include "pocd_dds/entities/open_calls.hpp"

namespace pocd::dds {

/// From here on, each message that comes by shared memory or UDP is an open call until Fast DDS
/// 2.9.1 has taken it. For that it takes the lock of discovery: when discovery is deadlocked
/// (Fast-DDS #6502), a call does not return as soon as any other participant has said anything,
/// which each does several times per lease. Costs two atomic writes per message.
///
/// What is not watched, in words: other transports such as TCP, and those that a profile's
/// useBuiltinTransports adds to its own. Empty: all is.
std::string watch_transports(eprosima::fastdds::dds::DomainParticipantQos& qos,
                             const std::shared_ptr<OpenCalls>& calls);

}  // namespace pocd::dds

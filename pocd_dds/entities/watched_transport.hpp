// How Fast DDS takes what comes from the bus: whether it still does, and how much at a time.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <memory>
#include <mutex>
#include <string>

#include "pocd_dds/entities/open_calls.hpp"

namespace pocd::dds {

/// Of one participant.
struct Reception {
  /// Each message that comes by shared memory or UDP is an open call until Fast DDS 2.9.1 has taken
  /// it. For that it takes the lock of discovery: when discovery is deadlocked (Fast-DDS #6502), a
  /// call does not return as soon as any other participant has said anything, which each does
  /// several times per lease. Costs two atomic writes per message.
  std::shared_ptr<OpenCalls> calls;
  /// When set: Fast DDS takes one message at a time, whatever threads receive them. With security
  /// it has to: Fast DDS 2.9.1 matches all who authenticate by way of one variable without a lock
  /// (Fast-DDS #3362). Of two participants that are discovered at the same time by two threads, one
  /// is never authenticated: no topic of its is ever heard.
  std::shared_ptr<std::mutex> turn;
};

/// What is not watched, in words: other transports such as TCP, and those that a profile's
/// useBuiltinTransports adds to its own. Empty: all is.
std::string watch_transports(eprosima::fastdds::dds::DomainParticipantQos& qos,
                             const Reception& reception);

}  // namespace pocd::dds

// Shared memory between processes of one host that goes on when one of them is killed.
#pragma once

#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>

#include <cstdint>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <filesystem>
#include <string>

namespace pocd::dds {

/// Empty when a participant's segment of this size finds room in the folder; else one line that
/// says what is free, what is needed and what to set. Without room Fast DDS dies by SIGBUS.
std::string shared_memory_problem(const std::filesystem::path& folder, std::uint64_t bytes);

/// Fast DDS's shared memory, and remedies for what Fast DDS 2.9.1 does not notice.
///
/// A port, /dev/shm/fastrtps_portN, is made anew under its name when the process that listens there
/// was killed or stood still. Who has opened the old file then writes to nobody, or listens where
/// nobody writes, for as long as the participant lives. Once a second this looks whether the files
/// that it has opened are still those of that name, and opens the new ones where they are not.
///
/// Where the last message of a killed process holds up a port (ReceivingThread), the port is opened
/// anew, too: what others have sent meanwhile is lost there, or sent again where it is reliable.
///
/// Without room for its segment it is not used, with a warning; everything then goes over the other
/// transports.
class LastingSharedMemory : public eprosima::fastdds::rtps::SharedMemTransportDescriptor {
 public:
  explicit LastingSharedMemory(
      const eprosima::fastdds::rtps::SharedMemTransportDescriptor& settings);
  eprosima::fastdds::rtps::TransportInterface* create_transport() const override;
};

/// Puts it in place of each shared memory of this participant.
void make_shared_memory_last(eprosima::fastdds::dds::DomainParticipantQos& qos);

}  // namespace pocd::dds

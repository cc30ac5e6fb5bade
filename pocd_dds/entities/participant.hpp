// The one DDS participant of a process, and what belongs to it.
#pragma once

#include <array>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "pocd_dds/entities/topic_table.hpp"

namespace eprosima::fastdds::dds {
class DataReader;
class DataReaderListener;
}  // namespace eprosima::fastdds::dds

namespace pocd::dds {

struct BusOptions {
  int domain = 0;             ///< 0 .. 232
  std::string profiles_file;  ///< XML profiles of the operator; empty: none
  std::string name = "pocd";
  /// Folder with the identity and the permissions of this participant (docs/security.md): it then
  /// talks to nobody who has none by the same authority. Empty: no security.
  std::string security_folder = "";
  /// Looks for participants of this host by unicast, too, where a profile names no initial peers:
  /// finds them without multicast.
  bool ask_this_host = false;
  /// What others may read of it before they know any of its topics.
  std::string user_data = "";
  /// Others forget this participant when they have not heard of it for so long [s].
  double lease_s = 5.0;
  /// Discovery that stands still for so long hangs [s].
  double stall_s = 10.0;
  /// Hears of everything that is discovered, from the first moment; must outlive the participant.
  eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr;
};

/// ROS_DOMAIN_ID, or 0 when it is not set. Throws InputError when it is no domain.
int default_domain();

using EndpointGuid = std::array<std::uint8_t, 16>;
inline EndpointGuid to_guid(const eprosima::fastdds::dds::InstanceHandle_t& handle) {
  EndpointGuid guid{};
  for (std::size_t i = 0; i < guid.size(); ++i) guid[i] = handle.value[i];
  return guid;
}

/// Deletes everything it made when it goes; readers and writers keep it alive. Thread-safe.
///
/// An XML profile that is marked as default replaces what the participant would be; one named like
/// a topic replaces the table's quality of service of the readers or writers of that topic.
class Participant {
 public:
  /// Throws InputError: no such domain, unreadable profiles, files of security that are missing, or
  /// no participant to be had.
  explicit Participant(const BusOptions& options);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// The topic, made on first use; it goes with its last user, who has to have deleted its reader
  /// or writer by then. Throws InputError when the name is taken by another type, or the name of
  /// the type by another way to read and write it.
  std::shared_ptr<eprosima::fastdds::dds::Topic> topic(const std::string& name,
                                                       eprosima::fastdds::dds::TypeSupport type);

  eprosima::fastdds::dds::DataWriterQos writer_qos(const std::string& topic,
                                                   const Delivery& delivery) const;
  eprosima::fastdds::dds::DataReaderQos reader_qos(const std::string& topic,
                                                   const Delivery& delivery) const;

  /// Every reader of this participant is made and deleted here, one at a time: Fast DDS 2.9.1 keeps
  /// them in a list that `WLP::remove_local_reader` changes without a lock. (It has one for
  /// writers.) Not from a listener, and not from the function given to set_bus_log: both may wait
  /// for a callback that runs. In the latter, make_reader throws InputError and delete_reader says
  /// so on stderr. Null when Fast DDS makes none.
  eprosima::fastdds::dds::DataReader* make_reader(
      eprosima::fastdds::dds::Subscriber& subscriber, eprosima::fastdds::dds::Topic& topic,
      const eprosima::fastdds::dds::DataReaderQos& qos,
      eprosima::fastdds::dds::DataReaderListener& listener);
  void delete_reader(eprosima::fastdds::dds::Subscriber& subscriber,
                     eprosima::fastdds::dds::DataReader& reader);

  using Guid = EndpointGuid;
  /// When this reader or writer of another participant announces another version of its type than
  /// this process has: who it is and what the versions are, in words.
  std::optional<std::string> other_version(const Guid& endpoint) const;

  /// A reader or writer of this participant, for those who announce them to others.
  struct Endpoint {
    std::string topic;
    bool reads = false;
  };
  void joined(const Guid& endpoint, const Endpoint& what);
  void left(const Guid& endpoint);
  std::map<Guid, Endpoint> endpoints() const;

  /// For how long Fast DDS has not taken what came from the bus [s]. Never waits. Beyond
  /// BusOptions::stall_s, which is logged once, its discovery is deadlocked: endpoints that are
  /// made or deleted then wait for ever, as does the end of this participant.
  double still_s() const;
  bool hangs() const;
  /// How often that has begun.
  std::uint64_t stalls() const;

  eprosima::fastdds::dds::DomainParticipant* get() const;
  eprosima::fastdds::dds::Publisher* publisher() const;
  eprosima::fastdds::dds::Subscriber* subscriber() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::dds

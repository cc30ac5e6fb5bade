// The one DDS participant of a process, and what belongs to it.
#pragma once

#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <memory>
#include <string>

#include "pocd_dds/entities/topic_table.hpp"

namespace pocd::dds {

struct BusOptions {
  int domain = 0;             ///< 0 .. 232
  std::string profiles_file;  ///< XML profiles of the operator; empty: none
  std::string name = "pocd";
  /// Others forget this participant when they have not heard of it for so long [s].
  double lease_s = 5.0;
  /// Hears of everything that is discovered, from the first moment; must outlive the participant.
  eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr;
};

/// ROS_DOMAIN_ID, or 0 when it is not set. Throws InputError when it is no domain.
int default_domain();

/// Deletes everything it made when it goes; readers and writers keep it alive. Thread-safe.
///
/// An XML profile that is marked as default replaces what the participant would be; one named like
/// a topic replaces the table's quality of service of the readers or writers of that topic.
class Participant {
 public:
  /// Throws InputError: no such domain, unreadable profiles, or no participant to be had.
  explicit Participant(const BusOptions& options);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// The topic, made on first use; it goes with its last user, who has to have deleted its reader
  /// or writer by then. Throws InputError when the name is taken by another type.
  std::shared_ptr<eprosima::fastdds::dds::Topic> topic(const std::string& name,
                                                       eprosima::fastdds::dds::TypeSupport type);

  eprosima::fastdds::dds::DataWriterQos writer_qos(const std::string& topic,
                                                   const Delivery& delivery) const;
  eprosima::fastdds::dds::DataReaderQos reader_qos(const std::string& topic,
                                                   const Delivery& delivery) const;

  eprosima::fastdds::dds::DomainParticipant* get() const;
  eprosima::fastdds::dds::Publisher* publisher() const;
  eprosima::fastdds::dds::Subscriber* subscriber() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pocd::dds

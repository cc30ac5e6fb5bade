#include "pocd_dds/entities/participant_qos.hpp"

#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "pocd/common/check.hpp"
#include "pocd_dds/entities/bus_log.hpp"
#include "pocd_dds/entities/shared_memory.hpp"
#include "pocd_dds/entities/socket_buffers.hpp"

namespace pocd::dds {

using namespace eprosima::fastdds::dds;  // NOLINT: this file is about nothing else
namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

// A 0.9 MB image through the default segment of 512 KB takes ten times as long; 32 MB hold one
// second of three streams.
constexpr std::uint32_t kSegmentBytes = 32u << 20;
// Images in 64 KB fragments over UDP need room for a whole one.
constexpr std::uint32_t kSocketBytes = 4u << 20;
// Within a lease; one that is lost on the way does no harm.
constexpr double kSignsOfLife = 5.0;
// A domain has ports for participants 0 to 119 of a host (RTPS 2.2, 9.6.1.1). Fast DDS tries 100
// and makes one that hears nobody when they are taken.
constexpr std::uint32_t kLastOfAHost = 119;

void set_transports(DomainParticipantQos& qos) {
  auto shared_memory = std::make_shared<rtps::SharedMemTransportDescriptor>();
  shared_memory->segment_size(kSegmentBytes);
  auto udp = std::make_shared<rtps::UDPv4TransportDescriptor>();
  udp->sendBufferSize = kSocketBytes;
  udp->receiveBufferSize = kSocketBytes;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports = {shared_memory, udp};
}

std::string buffer_text(std::uint32_t bytes) {
  return bytes == 0 ? "the system's default size" : std::to_string(bytes) + " bytes";
}

void warn_of_small_buffers() {
  static std::once_flag once;
  std::call_once(once, [] {
    const std::string problem = socket_buffer_problem(kSocketBytes);
    if (!problem.empty()) log(LogLevel::kWarning, problem);
  });
}

/// A profile's transports are taken as they are.
void warn_of_profile(const DomainParticipantQos& qos) {
  if (qos.transport().use_builtin_transports && qos.transport().user_transports.empty()) return;
  bool udp = false;
  for (const auto& transport : qos.transport().user_transports) {
    const auto* found = dynamic_cast<const rtps::UDPTransportDescriptor*>(transport.get());
    if (found == nullptr) continue;
    udp = true;
    if (found->receiveBufferSize >= kSocketBytes && found->sendBufferSize >= kSocketBytes) continue;
    static std::once_flag once;
    std::call_once(once, [&] {
      log(LogLevel::kWarning,
          "the profile of the participant gives UDP socket buffers of " +
              buffer_text(found->receiveBufferSize) + " to receive and " +
              buffer_text(found->sendBufferSize) +
              " to send: images will be lost; set receiveBufferSize and sendBufferSize of its "
              "transport to " +
              std::to_string(kSocketBytes));
    });
  }
  if (udp) warn_of_small_buffers();
}

/// With a discovery server (ROS_DISCOVERY_SERVER) a client is told of topics that it has itself,
/// and of no other. Whoever looks at discovery, to find robots by their topics, is to be told of
/// all.
void follow_discovery_server(DomainParticipantQos& qos) {
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  if (discovery.discoveryProtocol != eprosima::fastrtps::rtps::DiscoveryProtocol_t::SIMPLE) return;
  rtps::RemoteServerList_t servers;
  if (!rtps::load_environment_server_info(servers) || servers.empty()) return;
  discovery.discoveryProtocol = eprosima::fastrtps::rtps::DiscoveryProtocol_t::SUPER_CLIENT;
  discovery.m_DiscoveryServers = servers;
}

/// Every place where a participant of this host may listen, and the multicast address, which a list
/// of peers replaces.
void ask_this_host(int domain, DomainParticipantQos& qos) {
  auto& wire = qos.wire_protocol();
  if (!wire.builtin.initialPeersList.empty()) return;
  const auto add = [&](const char* address, std::uint32_t port) {
    eprosima::fastrtps::rtps::Locator_t locator(LOCATOR_KIND_UDPv4, port);
    eprosima::fastrtps::rtps::IPLocator::setIPv4(locator, address);
    wire.builtin.initialPeersList.push_back(locator);
  };
  const auto number = static_cast<std::uint32_t>(domain);
  add("239.255.0.1", wire.port.getMulticastPort(number));  // RTPS 2.2, 9.6.1.4.1
  for (std::uint32_t i = 0; i <= kLastOfAHost; ++i) {
    add("127.0.0.1", wire.port.getUnicastPort(number, i));
  }
}

/// Authentication, access control and encryption by DDS Security's built-in plugins. The files are
/// those of an enclave of ROS 2, so that its tools can make them.
void set_security(const std::string& folder, DomainParticipantQos& qos) {
  const auto file = [&](const char* name) {
    const auto path = std::filesystem::absolute(std::filesystem::path(folder) / name);
    if (!std::filesystem::is_regular_file(path)) {
      throw InputError(path.string() + ": no such file (security)");
    }
    return "file://" + path.string();
  };
  const std::string auth = "dds.sec.auth.builtin.PKI-DH.";
  const std::string access = "dds.sec.access.builtin.Access-Permissions.";
  auto& properties = qos.properties().properties();
  properties.emplace_back("dds.sec.auth.plugin", "builtin.PKI-DH");
  properties.emplace_back(auth + "identity_ca", file("identity_ca.cert.pem"));
  properties.emplace_back(auth + "identity_certificate", file("cert.pem"));
  properties.emplace_back(auth + "private_key", file("key.pem"));
  properties.emplace_back("dds.sec.access.plugin", "builtin.Access-Permissions");
  properties.emplace_back(access + "permissions_ca", file("permissions_ca.cert.pem"));
  properties.emplace_back(access + "governance", file("governance.p7s"));
  properties.emplace_back(access + "permissions", file("permissions.p7s"));
  properties.emplace_back("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
}

}  // namespace

DomainParticipantQos participant_qos(const BusOptions& options) {
  DomainParticipantFactory* factory = DomainParticipantFactory::get_instance();
  factory->load_profiles();
  if (!options.profiles_file.empty()) {
    if (!std::filesystem::is_regular_file(options.profiles_file)) {
      throw InputError(options.profiles_file + ": no such file (XML profiles)");
    }
    if (factory->load_XML_profiles_file(options.profiles_file) != ReturnCode_t::RETCODE_OK) {
      throw InputError(options.profiles_file + ": not a valid file of XML profiles");
    }
    // Makes the factory look at the profiles again: it did so before this file was there.
    factory->set_default_participant_qos(PARTICIPANT_QOS_DEFAULT);
  }
  DomainParticipantQos qos;
  factory->get_default_participant_qos(qos);
  if (qos.transport().user_transports.empty() && qos.transport().use_builtin_transports) {
    set_transports(qos);
    warn_of_small_buffers();
  } else {
    warn_of_profile(qos);
  }
  make_shared_memory_last(qos);
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  if (discovery.leaseDuration ==
      DomainParticipantQos().wire_protocol().builtin.discovery_config.leaseDuration) {
    discovery.leaseDuration = eprosima::fastrtps::Duration_t(options.lease_s);
    discovery.leaseDuration_announcementperiod =
        eprosima::fastrtps::Duration_t(options.lease_s / kSignsOfLife);
  }
  auto& tries = qos.wire_protocol().builtin.mutation_tries;
  if (tries == DomainParticipantQos().wire_protocol().builtin.mutation_tries) tries = kLastOfAHost;
  if (qos.name().size() == 0 || qos.name() == "RTPSParticipant") qos.name(options.name);
  if (options.ask_this_host) ask_this_host(options.domain, qos);
  if (!options.user_data.empty()) {
    qos.user_data().data_vec({options.user_data.begin(), options.user_data.end()});
  }
  if (options.listener != nullptr) follow_discovery_server(qos);
  if (!options.security_folder.empty()) set_security(options.security_folder, qos);
  return qos;
}

}  // namespace pocd::dds

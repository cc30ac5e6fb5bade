#include "pocd_dds/entities/watched_transport.hpp"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/TCPTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv6TransportDescriptor.h>

#include <utility>

#include "pocd_dds/entities/shared_memory.hpp"

namespace pocd::dds {
namespace {

namespace rtps = eprosima::fastdds::rtps;
namespace fastrtps = eprosima::fastrtps::rtps;

struct Below final : rtps::ChainingTransportDescriptor {
  using ChainingTransportDescriptor::ChainingTransportDescriptor;
  rtps::TransportInterface* create_transport() const override {
    return low_level_descriptor->create_transport();
  }
};

/// Passes everything on, and sends as the transport below does.
class WatchedTransport final : public rtps::ChainingTransport {
 public:
  WatchedTransport(const std::shared_ptr<rtps::TransportDescriptorInterface>& below,
                   Reception reception)
      : ChainingTransport(Below(below)), reception_(std::move(reception)) {}

  bool OpenOutputChannel(rtps::SendResourceList& senders,
                         const fastrtps::Locator_t& locator) override {
    // It has to find its own senders again in this list, so they are not wrapped.
    return low_level_transport_->OpenOutputChannel(senders, locator);
  }
  rtps::TransportDescriptorInterface* get_configuration() override {
    return low_level_transport_->get_configuration();
  }
  void shutdown() override { low_level_transport_->shutdown(); }
  bool send(fastrtps::SenderResource* sender, const fastrtps::octet* data, std::uint32_t size,
            fastrtps::LocatorsIterator* begin, fastrtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& latest) override {
    return sender->send(data, size, begin, end, latest);
  }
  void receive(rtps::TransportReceiverInterface* next, const fastrtps::octet* data,
               std::uint32_t size, const fastrtps::Locator_t& local,
               const fastrtps::Locator_t& remote) override {
    const OpenCalls::Call call(*reception_.calls);
    std::unique_lock<std::mutex> turn;
    if (reception_.turn) turn = std::unique_lock<std::mutex>(*reception_.turn);
    next->OnDataReceived(data, size, local, remote);
  }

 private:
  const Reception reception_;
};

/// Stays a descriptor of its kind, as Fast DDS asks for that.
template <class Descriptor>
class Watched final : public Descriptor {
 public:
  Watched(const Descriptor& settings, Reception reception)
      : Descriptor(settings), reception_(std::move(reception)) {}
  rtps::TransportInterface* create_transport() const override {
    return new WatchedTransport(std::make_shared<Descriptor>(static_cast<const Descriptor&>(*this)),
                                reception_);
  }

 private:
  Reception reception_;
};

template <class Descriptor>
bool watch(std::shared_ptr<rtps::TransportDescriptorInterface>& transport,
           const Reception& reception) {
  const auto* found = dynamic_cast<const Descriptor*>(transport.get());
  if (found == nullptr) return false;
  transport = std::make_shared<Watched<Descriptor>>(*found, reception);
  return true;
}

}  // namespace

std::string watch_transports(eprosima::fastdds::dds::DomainParticipantQos& qos,
                             const Reception& reception) {
  std::string unwatched;
  const auto add = [&](const char* name) {
    if (unwatched.find(name) == std::string::npos) {
      unwatched += (unwatched.empty() ? "" : ", ") + std::string(name);
    }
  };
  for (auto& transport : qos.transport().user_transports) {
    if (watch<LastingSharedMemory>(transport, reception) ||
        watch<rtps::UDPv4TransportDescriptor>(transport, reception) ||
        watch<rtps::UDPv6TransportDescriptor>(transport, reception)) {
      continue;
    }
    const bool tcp = dynamic_cast<const rtps::TCPTransportDescriptor*>(transport.get()) != nullptr;
    add(tcp ? "TCP" : "a transport of another kind");
  }
  if (qos.transport().use_builtin_transports) add("the transports of useBuiltinTransports");
  return unwatched;
}

}  // namespace pocd::dds

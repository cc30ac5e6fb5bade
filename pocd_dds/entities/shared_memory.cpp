#include "pocd_dds/entities/shared_memory.hpp"

#include <fastdds/rtps/transport/TransportInterface.h>
#include <sys/statvfs.h>

#include <chrono>
#include <condition_variable>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "pocd_dds/entities/bus_log.hpp"
#include "pocd_dds/entities/one_at_a_time.hpp"
#include "pocd_dds/entities/port_files.hpp"
#include "pocd_dds/entities/receiving_thread.hpp"
#include "pocd_dds/entities/started_thread.hpp"

namespace pocd::dds {
namespace {

namespace rtps = eprosima::fastdds::rtps;
namespace fastrtps = eprosima::fastrtps::rtps;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kLook{1};
/// Fast DDS notices by itself that a process was killed that waited, within 2 s of its next sample.
constexpr std::chrono::seconds kPatience{3};
/// What was sent is read by then.
constexpr std::chrono::seconds kInFlight{10};
/// Where no room is found for one more segment.
constexpr std::chrono::seconds kRetry{60};
/// Ports of 52 KB and locks, beside the segment.
constexpr std::uint64_t kBeside = 1u << 20;

/// Over a list of its own, in place of the participant's.
class Destinations final : public rtps::LocatorsIterator {
 public:
  explicit Destinations(std::vector<rtps::Locator>::const_iterator at) : at_(at) {}
  rtps::LocatorsIterator& operator++() override {
    ++at_;
    return *this;
  }
  bool operator==(const rtps::LocatorsIterator& other) const override {
    return at_ == static_cast<const Destinations&>(other).at_;
  }
  bool operator!=(const rtps::LocatorsIterator& other) const override { return !(*this == other); }
  const rtps::Locator& operator*() const override { return *at_; }

 private:
  std::vector<rtps::Locator>::const_iterator at_;
};

/// The file of a port that was opened, and since when another one has its name.
struct OpenPort {
  std::uint64_t id = 0;
  Clock::time_point other_since{};
  bool sent = false;  // something, since then

  /// True when the file that was opened has had another one in its place for a while, and that
  /// matters: it is to receive, or something was sent. `follows` says whether Fast DDS has opened
  /// that one by itself.
  template <class Follows>
  bool replaced(std::uint32_t port, bool receives, const Follows& follows) {
    const std::uint64_t now_id = port_file_id(port);
    if ((now_id == id && id != 0) || (now_id == 0 && !receives)) {
      other_since = {};
      sent = false;
      return false;
    }
    const auto now = Clock::now();
    if (other_since == Clock::time_point{}) other_since = now;
    if (now - other_since < kPatience || !(receives || sent)) return false;
    if (!follows(now_id)) return true;
    *this = {now_id, {}, false};
    return false;
  }
};

class LastingTransport final : public rtps::TransportInterface {
 public:
  explicit LastingTransport(const rtps::SharedMemTransportDescriptor& settings)
      : TransportInterface(LOCATOR_KIND_SHM), settings_(settings) {}
  ~LastingTransport() override { stop_looking(); }

  bool init(const fastrtps::PropertyPolicy* properties) override {
    receiving_ = make(properties);
    if (!receiving_) return false;
    sending_ = sender(receiving_);
    if (!sending_) return false;
    looking_ = std::thread([this] { look(); });
    return true;
  }

  bool OpenOutputChannel(rtps::SendResourceList& senders, const rtps::Locator& locator) override {
    if (!IsLocatorSupported(locator)) return false;
    for (const auto& known : senders) {
      const auto* ours = dynamic_cast<const Sender*>(known.get());
      if (ours != nullptr && ours->transport == this) return true;
    }
    senders.push_back(std::make_unique<Sender>(*this));
    return true;
  }
  bool OpenInputChannel(const rtps::Locator& locator, rtps::TransportReceiverInterface* receiver,
                        std::uint32_t size) override {
    const std::lock_guard<std::mutex> lock(input_mutex_);
    Input input{locator, receiver, size, {}, nullptr};
    if (!open_input(input)) return false;
    inputs_.push_back(std::move(input));
    return true;
  }
  bool CloseInputChannel(const rtps::Locator& locator) override {
    const std::lock_guard<std::mutex> lock(input_mutex_);
    const bool closed = receiving_->CloseInputChannel(locator);
    inputs_.remove_if([&](const Input& input) { return input.locator == locator; });
    return closed;
  }
  void shutdown() override {
    stop_looking();
    receiving_->shutdown();
  }

  // All else is Fast DDS's.
  bool IsInputChannelOpen(const rtps::Locator& locator) const override {
    return receiving_->IsInputChannelOpen(locator);
  }
  bool IsLocatorSupported(const rtps::Locator& locator) const override {
    return locator.kind == LOCATOR_KIND_SHM;
  }
  bool is_locator_allowed(const rtps::Locator& locator) const override {
    return receiving_->is_locator_allowed(locator);
  }
  rtps::Locator RemoteToMainLocal(const rtps::Locator& remote) const override {
    return receiving_->RemoteToMainLocal(remote);
  }
  bool transform_remote_locator(const rtps::Locator& remote, rtps::Locator& out) const override {
    return receiving_->transform_remote_locator(remote, out);
  }
  bool DoInputLocatorsMatch(const rtps::Locator& left, const rtps::Locator& right) const override {
    return receiving_->DoInputLocatorsMatch(left, right);
  }
  rtps::LocatorList NormalizeLocator(const rtps::Locator& locator) override {
    return receiving_->NormalizeLocator(locator);
  }
  void select_locators(fastrtps::LocatorSelector& selector) const override {
    receiving_->select_locators(selector);
  }
  bool is_local_locator(const rtps::Locator& locator) const override {
    return receiving_->is_local_locator(locator);
  }
  rtps::TransportDescriptorInterface* get_configuration() override { return &settings_; }
  void AddDefaultOutputLocator(rtps::LocatorList& list) override {
    receiving_->AddDefaultOutputLocator(list);
  }
  bool getDefaultMetatrafficMulticastLocators(rtps::LocatorList& list,
                                              std::uint32_t port) const override {
    return receiving_->getDefaultMetatrafficMulticastLocators(list, port);
  }
  bool getDefaultMetatrafficUnicastLocators(rtps::LocatorList& list,
                                            std::uint32_t port) const override {
    return receiving_->getDefaultMetatrafficUnicastLocators(list, port);
  }
  bool getDefaultUnicastLocators(rtps::LocatorList& list, std::uint32_t port) const override {
    return receiving_->getDefaultUnicastLocators(list, port);
  }
  bool fillMetatrafficMulticastLocator(rtps::Locator& locator, std::uint32_t port) const override {
    return receiving_->fillMetatrafficMulticastLocator(locator, port);
  }
  bool fillMetatrafficUnicastLocator(rtps::Locator& locator, std::uint32_t port) const override {
    return receiving_->fillMetatrafficUnicastLocator(locator, port);
  }
  bool configureInitialPeerLocator(rtps::Locator& locator, const fastrtps::PortParameters& ports,
                                   std::uint32_t domain, rtps::LocatorList& list) const override {
    return receiving_->configureInitialPeerLocator(locator, ports, domain, list);
  }
  bool fillUnicastLocator(rtps::Locator& locator, std::uint32_t port) const override {
    return receiving_->fillUnicastLocator(locator, port);
  }
  std::uint32_t max_recv_buffer_size() const override { return receiving_->max_recv_buffer_size(); }

 private:
  struct Sender final : fastrtps::SenderResource {
    explicit Sender(LastingTransport& to) : SenderResource(LOCATOR_KIND_SHM), transport(&to) {
      send_lambda_ = [&to](const fastrtps::octet* data, std::uint32_t size,
                           fastrtps::LocatorsIterator* begin, fastrtps::LocatorsIterator* end,
                           const Clock::time_point& latest) {
        return to.send(data, size, *begin, *end, latest);
      };
    }
    const LastingTransport* transport;
  };
  /// A transport of Fast DDS, and the ports that it has opened to send.
  struct Sending {
    std::shared_ptr<rtps::TransportInterface> transport;
    rtps::SendResourceList way;
    std::map<std::uint32_t, OpenPort> ports;
  };
  struct Input {
    rtps::Locator locator;
    rtps::TransportReceiverInterface* receiver;
    std::uint32_t size;
    OpenPort port;
    std::unique_ptr<ReceivingThread> thread;
  };
  struct Retired {
    std::shared_ptr<Sending> sending;
    Clock::time_point since;
  };

  std::shared_ptr<rtps::TransportInterface> make(
      const fastrtps::PropertyPolicy* properties = nullptr) const {
    const OneAtATime turn(kSharedMemoryFolder);
    const std::string problem =
        shared_memory_problem(kSharedMemoryFolder, settings_.segment_size());
    if (!problem.empty()) {
      log(LogLevel::kWarning, problem);
      return nullptr;
    }
    std::shared_ptr<rtps::TransportInterface> made(settings_.create_transport());
    return made->init(properties) ? made : nullptr;
  }
  static std::shared_ptr<Sending> sender(
      const std::shared_ptr<rtps::TransportInterface>& transport) {
    auto sending = std::make_shared<Sending>();
    sending->transport = transport;
    rtps::Locator any;
    any.kind = LOCATOR_KIND_SHM;
    return transport->OpenOutputChannel(sending->way, any) ? sending : nullptr;
  }

  bool send(const fastrtps::octet* data, std::uint32_t size, fastrtps::LocatorsIterator& at,
            const fastrtps::LocatorsIterator& end, const Clock::time_point& latest) {
    std::vector<rtps::Locator> there;
    std::shared_ptr<Sending> sending;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      sending = sending_;
      for (; at != end; ++at) {
        const rtps::Locator& locator = *at;
        if (locator.kind != LOCATOR_KIND_SHM) continue;
        // Before it is opened: if it is replaced meanwhile, that is seen. Where there is no file,
        // nobody listens.
        const auto known = sending->ports.find(locator.port);
        if (known != sending->ports.end()) {
          known->second.sent |= known->second.other_since != Clock::time_point{};
        } else {
          const std::uint64_t id = port_file_id(locator.port);
          if (id == 0) continue;
          sending->ports[locator.port] = {id, {}, false};
        }
        there.push_back(locator);
      }
    }
    if (there.empty()) return true;
    Destinations from(there.begin()), to(there.end());
    return sending->way.front()->send(data, size, &from, &to, latest);
  }

  void look() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stopped_) {
      if (stop_.wait_for(lock, kLook, [this] { return stopped_; })) return;
      bool stale = false;
      for (auto& [port, open] : sending_->ports) {
        const std::uint64_t opened = open.id;
        stale |= open.replaced(port, false, [number = port, opened](std::uint64_t) {
          return !has_port_file(number, opened);
        });
      }
      lock.unlock();
      if (stale) send_anew();
      receive_anew();
      close_retired();
      lock.lock();
    }
  }
  void send_anew() {
    // One after the other: the files of the last one are still open, and no remedy helps faster.
    if (!retired_.empty() || Clock::now() < next_try_) return;
    next_try_ = Clock::now() + kRetry;
    const auto transport = make();
    auto next = transport ? sender(transport) : nullptr;
    if (!next) return;
    next_try_ = {};
    log(LogLevel::kWarning,
        "shared memory: a process on this host was killed and its port made anew; opens it anew to "
        "send");
    const std::lock_guard<std::mutex> lock(mutex_);
    sending_.swap(next);
    retired_.push_back({std::move(next), Clock::now()});
  }
  bool open_input(Input& input) {
    auto thread = std::make_unique<ReceivingThread>(input.receiver);
    bool opened = false;
    const int started = started_by(
        [&] { opened = receiving_->OpenInputChannel(input.locator, thread.get(), input.size); });
    if (!opened) return false;
    if (started == 0) {
      log_warning(
          "shared memory: no thread found that receives on port {}: not noticed if it hangs",
          input.locator.port);
    }
    thread->set_thread(started);
    input.thread = std::move(thread);
    input.port = {port_file_id(input.locator.port), {}, false};
    return true;
  }
  void receive_anew() {
    const std::lock_guard<std::mutex> lock(input_mutex_);
    for (Input& input : inputs_) {
      const std::uint32_t port = input.locator.port;
      const bool turns = input.thread && input.thread->turns();
      const bool replaced = input.port.replaced(
          port, true, [port](std::uint64_t id) { return id != 0 && has_port_file(port, id); });
      if (!turns && !replaced) continue;
      log_warning("shared memory: {} {}; opens it anew to receive",
                  turns ? "what a process has said before its end holds up port"
                        : "another process has made anew port",
                  port);
      receiving_->CloseInputChannel(input.locator);
      input.thread.reset();
      if (!open_input(input)) {
        log_warning("shared memory: port {} cannot be opened; tried again", port);
        input.port = {};
      }
    }
  }
  void close_retired() {
    if (retired_.empty() || Clock::now() - retired_.front().since < kInFlight) return;
    std::vector<PortFileGuard> kept;
    for (const auto& [port, open] : retired_.front().sending->ports) kept.emplace_back(port);
    retired_.pop_front();
  }
  void stop_looking() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
    }
    stop_.notify_all();
    if (looking_.joinable()) looking_.join();
  }

  rtps::SharedMemTransportDescriptor settings_;
  std::mutex input_mutex_;
  std::list<Input> inputs_;                              // outlive what receives
  std::shared_ptr<rtps::TransportInterface> receiving_;  // sends, too, until it has to be replaced
  std::mutex mutex_;                                     // guards these three
  std::shared_ptr<Sending> sending_;
  bool stopped_ = false;
  std::condition_variable stop_;
  // Of the thread.
  std::list<Retired> retired_;
  Clock::time_point next_try_{};
  std::thread looking_;
};

std::string mebibytes(std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

}  // namespace

std::string shared_memory_problem(const std::filesystem::path& folder, std::uint64_t bytes) {
  struct statvfs space {};
  if (statvfs(folder.c_str(), &space) != 0) return "";  // Fast DDS has its own word for that
  const std::uint64_t free_bytes = std::uint64_t{space.f_bavail} * space.f_frsize;
  if (free_bytes >= bytes + kBeside) return "";
  return folder.string() + " has " + mebibytes(free_bytes) + " free, shared memory needs " +
         mebibytes(bytes + kBeside) +
         ": it is not used, everything goes over the other transports; enlarge it (docker: "
         "--shm-size) or remove what is left over (fastdds shm clean)";
}

LastingSharedMemory::LastingSharedMemory(const rtps::SharedMemTransportDescriptor& settings)
    : SharedMemTransportDescriptor(settings) {}

rtps::TransportInterface* LastingSharedMemory::create_transport() const {
  return new LastingTransport(*this);
}

void make_shared_memory_last(eprosima::fastdds::dds::DomainParticipantQos& qos) {
  for (auto& transport : qos.transport().user_transports) {
    const auto* found = dynamic_cast<const rtps::SharedMemTransportDescriptor*>(transport.get());
    if (found != nullptr) transport = std::make_shared<LastingSharedMemory>(*found);
  }
}

}  // namespace pocd::dds

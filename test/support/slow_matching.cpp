// Loaded into a program before its libraries (LD_PRELOAD): between the time when Fast DDS has said
// whom it authenticates and the time when it reads that, there are 0.2 s. Whoever is discovered
// meanwhile by another thread takes the other one's place (Fast-DDS #3362).
#include <dlfcn.h>
#include <fastdds/rtps/builtin/data/ReaderProxyData.h>
#include <fastdds/rtps/writer/StatelessWriter.h>

#include <chrono>
#include <thread>

namespace eprosima::fastrtps::rtps {

bool StatelessWriter::matched_reader_add(const ReaderProxyData& reader) {
  using Function = bool (*)(StatelessWriter*, const ReaderProxyData&);
  static const auto real = reinterpret_cast<Function>(
      dlsym(RTLD_NEXT,
            "_ZN8eprosima8fastrtps4rtps15StatelessWriter18matched_reader_addERKNS1_15ReaderProxyDat"
            "aE"));
  constexpr std::uint32_t kHandshakes = 0x000201C4;  // DDS Security 1.1, 7.4.5
  if (reader.guid().entityId == EntityId_t(kHandshakes)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  return real(this, reader);
}

}  // namespace eprosima::fastrtps::rtps

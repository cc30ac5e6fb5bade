#include "page_file.hpp"

#define XXH_INLINE_ALL
#include <fcntl.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

constexpr std::uint32_t kGranule = 4096;

}  // namespace

PageFile::PageFile(const std::string& folder) : folder_(folder) {
  std::string name = folder + "/pocd_map_XXXXXX";
  file_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (file_ < 0) {
    throw InputError("map.memory.folder: no file can be made in \"" + folder +
                     "\": " + std::strerror(errno));
  }
  ::unlink(name.c_str());
}

PageFile::~PageFile() { ::close(file_); }

std::optional<PageRef> PageFile::write(const std::vector<std::uint8_t>& bytes) {
  PageRef page;
  page.size = static_cast<std::uint32_t>(bytes.size());
  page.capacity = (page.size + kGranule - 1) / kGranule * kGranule;
  page.checksum = XXH3_64bits(bytes.data(), bytes.size());
  // A free place up to a quarter too large is taken rather than new space.
  const auto place = free_.lower_bound(page.capacity);
  const bool reuse = place != free_.end() && place->first <= page.capacity + page.capacity / 4;
  page.offset = reuse ? place->second.back() : end_;
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::pwrite(file_, bytes.data() + done, bytes.size() - done,
                               static_cast<off_t>(page.offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      error_ = n < 0 ? std::strerror(errno) : "nothing written";
      return std::nullopt;
    }
    done += static_cast<std::size_t>(n);
  }
  if (reuse) {
    page.capacity = place->first;
    place->second.pop_back();
    if (place->second.empty()) free_.erase(place);
  } else {
    end_ += page.capacity;
  }
  used_ += page.capacity;
  return page;
}

std::optional<std::vector<std::uint8_t>> PageFile::read(const PageRef& page,
                                                        std::string& reason) const {
  std::vector<std::uint8_t> bytes(page.size);
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::pread(file_, bytes.data() + done, bytes.size() - done,
                              static_cast<off_t>(page.offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      reason = n < 0 ? std::strerror(errno) : "the file is cut short";
      return std::nullopt;
    }
    done += static_cast<std::size_t>(n);
  }
  if (XXH3_64bits(bytes.data(), bytes.size()) != page.checksum) {
    reason = "the checksum does not fit";
    return std::nullopt;
  }
  return bytes;
}

void PageFile::release(const PageRef& page) {
  free_[page.capacity].push_back(page.offset);
  used_ -= page.capacity;
}

}  // namespace pocd

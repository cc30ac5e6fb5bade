// A file of pages of different sizes for what does not fit in memory.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pocd {

/// Where a page is. size 0: nowhere.
struct PageRef {
  std::uint64_t offset = 0;
  std::uint32_t size = 0;
  std::uint32_t capacity = 0;  // bytes reserved at offset
  std::uint64_t checksum = 0;
};

/// The file has no name once it is open: nothing is left behind, however the process ends. read()
/// may be called from several threads, as long as nothing is written.
class PageFile {
 public:
  /// Throws InputError naming the folder when no file can be made there.
  explicit PageFile(const std::string& folder);
  ~PageFile();
  PageFile(const PageFile&) = delete;
  PageFile& operator=(const PageFile&) = delete;

  /// The place of the page, or nothing when the disk did not take it; error() says why.
  std::optional<PageRef> write(const std::vector<std::uint8_t>& bytes);
  /// The page as written, or nothing when it is unreadable or damaged; `reason` says which.
  std::optional<std::vector<std::uint8_t>> read(const PageRef& page, std::string& reason) const;
  void release(const PageRef& page);

  const std::string& error() const { return error_; }
  const std::string& folder() const { return folder_; }
  std::uint64_t used_bytes() const { return used_; }

 private:
  std::string folder_;
  int file_ = -1;
  std::uint64_t end_ = 0;
  std::uint64_t used_ = 0;
  std::map<std::uint32_t, std::vector<std::uint64_t>> free_;  // offsets by capacity
  std::string error_;
};

}  // namespace pocd

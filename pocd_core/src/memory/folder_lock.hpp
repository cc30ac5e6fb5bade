// One process at a time writes to a folder.
#pragma once

#include <filesystem>

namespace pocd::memory {

/// The kernel takes the lock back however the process ends.
class FolderLock {
 public:
  /// Makes the folder when it is missing. Throws InputError when that fails, the folder cannot be
  /// written, or another process holds it.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_ = -1;
};

}  // namespace pocd::memory

#include "folder_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "pocd/common/check.hpp"

namespace pocd::memory {

FolderLock::FolderLock(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw InputError("memory folder " + folder.string() + ": " + error.message());
  const std::string name = (folder / "lock").string();
  file_ = ::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0) {
    throw InputError("memory folder " + folder.string() +
                     ": cannot be written: " + std::strerror(errno));
  }
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
    char holder[32] = "";
    const ssize_t n = ::read(file_, holder, sizeof holder - 1);
    ::close(file_);
    throw InputError("memory folder " + folder.string() + ": is in use" +
                     (n > 0 ? " by process " + std::string(holder) : ""));
  }
  const std::string me = std::to_string(::getpid());
  // Only for the message above: that it could not be written is no reason to stop.
  if (::ftruncate(file_, 0) == 0) static_cast<void>(!::pwrite(file_, me.data(), me.size(), 0));
}

FolderLock::~FolderLock() { ::close(file_); }

}  // namespace pocd::memory

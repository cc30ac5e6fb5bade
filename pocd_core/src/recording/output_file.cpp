#include "output_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "compression.hpp"
#include "pocd/common/check.hpp"

namespace pocd::recording {

OutputFile::OutputFile(const std::filesystem::path& path) : path_(path) {
  fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    throw InputError(path_.string() +
                     ": cannot be created: " + std::system_category().message(errno));
  }
}

OutputFile::~OutputFile() {
  if (fd_ >= 0) ::close(fd_);
}

void OutputFile::fail(const char* what, int error) const {
  throw InputError(path_.string() + ": " + what + " at byte " + std::to_string(size_) + ": " +
                   std::system_category().message(error));
}

void OutputFile::reserve(std::uint64_t bytes) {
  // The size stays: a reader never sees the reserve, whatever happens to this process.
  if (::fallocate(fd_, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(size_), static_cast<off_t>(bytes)) ==
      0) {
    return;
  }
  const int error = errno;
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) fail("no room left", error);
}

void OutputFile::append(const Bytes& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(fd_, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int error = n == 0 ? EIO : errno;
      if (::ftruncate(fd_, static_cast<off_t>(size_)) == 0) {
        ::lseek(fd_, static_cast<off_t>(size_), SEEK_SET);
      }
      fail("cannot be written", error);
    }
    done += static_cast<std::size_t>(n);
  }
  size_ += bytes.size();
  crc_ = crc32_of(bytes.data(), bytes.size(), crc_);
}

void OutputFile::close() {
  if (fd_ < 0) return;
  if (::ftruncate(fd_, static_cast<off_t>(size_)) != 0 && errno != EINVAL) {
    fail("cannot be cut to its size", errno);
  }
  const int result = ::close(fd_);
  fd_ = -1;
  if (result != 0) fail("cannot be closed", errno);
}

}  // namespace pocd::recording

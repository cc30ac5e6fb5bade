#include "pocd/recording/byte_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "pocd/common/check.hpp"

namespace pocd::recording {
namespace {

class FileSource : public ByteSource {
 public:
  explicit FileSource(const std::filesystem::path& path) {
    fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat status {};
    if (fd_ < 0 || ::fstat(fd_, &status) != 0) {
      const int error = errno;
      if (fd_ >= 0) ::close(fd_);
      throw InputError(path.string() +
                       ": cannot be read: " + std::system_category().message(error));
    }
    if (!S_ISREG(status.st_mode)) {
      ::close(fd_);
      throw InputError(path.string() + ": is not a file");
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
  }
  ~FileSource() override { ::close(fd_); }

  std::uint64_t size() const override { return size_; }

  void read(std::uint64_t offset, std::uint8_t* out, std::size_t size) const override {
    std::size_t done = 0;
    while (done < size) {
      const ssize_t n = ::pread(fd_, out + done, size - done, static_cast<off_t>(offset + done));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) {
        throw DamagedData(offset + done,
                          "cannot be read: " + std::system_category().message(errno));
      }
      if (n == 0) throw DamagedData(offset + done, "the file ends here");
      done += static_cast<std::size_t>(n);
    }
  }

 private:
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

class MemorySource : public ByteSource {
 public:
  explicit MemorySource(Bytes bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  void read(std::uint64_t offset, std::uint8_t* out, std::size_t size) const override {
    if (offset > bytes_.size() || size > bytes_.size() - offset) {
      throw DamagedData(std::min<std::uint64_t>(offset, bytes_.size()), "the data ends here");
    }
    std::copy_n(bytes_.data() + offset, size, out);
  }

 private:
  Bytes bytes_;
};

}  // namespace

std::unique_ptr<ByteSource> open_file_source(const std::filesystem::path& path) {
  return std::make_unique<FileSource>(path);
}

std::unique_ptr<ByteSource> memory_source(Bytes bytes) {
  return std::make_unique<MemorySource>(std::move(bytes));
}

}  // namespace pocd::recording

// A DDS domain for one test.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace pocd {

/// A DDS domain that no other test uses, held by a lock on a file for as long as the object lives.
class TestDomain {
 public:
  TestDomain() {
    const auto folder = std::filesystem::temp_directory_path() /
                        ("pocd_test_domains_" + std::to_string(::getuid()));
    std::filesystem::create_directories(folder);
    int error = 0;
    for (number_ = 100; number_ < 200; ++number_) {
      file_ = open((folder / std::to_string(number_)).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      if (file_ >= 0 && flock(file_, LOCK_EX | LOCK_NB) == 0) return;
      error = errno;
      if (file_ >= 0) close(file_);
    }
    throw std::runtime_error("no free domain from 100 to 199, " + folder.string() + ": " +
                             std::system_category().message(error));
  }
  ~TestDomain() { close(file_); }
  TestDomain(const TestDomain&) = delete;
  TestDomain& operator=(const TestDomain&) = delete;

  int number() const { return number_; }
  std::string text() const { return std::to_string(number_); }

 private:
  int number_ = 0;
  int file_ = -1;
};

}  // namespace pocd

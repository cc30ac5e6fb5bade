#include "unpacked_file.hpp"

#include <unistd.h>
#include <zstd.h>

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "pocd/common/check.hpp"

namespace pocd::recording {
namespace {

void unpack(const std::filesystem::path& from, const std::filesystem::path& to) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  POCD_CHECK(stream != nullptr);
  std::ifstream in(from, std::ios::binary);
  std::ofstream out(to, std::ios::binary);
  std::vector<char> packed(ZSTD_DStreamInSize()), bytes(ZSTD_DStreamOutSize());
  std::size_t wanted = 1;
  while (in) {
    in.read(packed.data(), static_cast<std::streamsize>(packed.size()));
    ZSTD_inBuffer input{packed.data(), static_cast<std::size_t>(in.gcount()), 0};
    while (input.pos < input.size) {
      ZSTD_outBuffer output{bytes.data(), bytes.size(), 0};
      wanted = ZSTD_decompressStream(stream.get(), &output, &input);
      if (ZSTD_isError(wanted)) {
        throw InputError(from.string() + ": zstd: " + ZSTD_getErrorName(wanted));
      }
      out.write(bytes.data(), static_cast<std::streamsize>(output.pos));
    }
  }
  if (wanted != 0) throw InputError(from.string() + ": zstd: the file ends early");
  out.close();
  if (!out) {
    throw InputError(from.string() + ": cannot be unpacked into " + to.parent_path().string() +
                     ": no room? (TMPDIR names another folder)");
  }
}

}  // namespace

UnpackedFile::UnpackedFile(const std::filesystem::path& file) {
  std::string name = (std::filesystem::temp_directory_path() / "pocd_unpacked_XXXXXX").string();
  const int descriptor = ::mkstemp(name.data());
  if (descriptor < 0) throw InputError(name + ": cannot be made");
  ::close(descriptor);
  path_ = name;
  try {
    unpack(file, path_);
  } catch (...) {
    ::unlink(path_.c_str());
    throw;
  }
}

UnpackedFile::~UnpackedFile() { ::unlink(path_.c_str()); }

}  // namespace pocd::recording

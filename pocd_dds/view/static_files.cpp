#include "view/static_files.hpp"

#include <zlib.h>

#include <fstream>
#include <sstream>

#include "pocd/common/check.hpp"

namespace pocd::view {
namespace {

const std::map<std::string, std::string>& types() {
  static const std::map<std::string, std::string> known{
      {".html", "text/html; charset=utf-8"},     {".css", "text/css; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"}, {".svg", "image/svg+xml"},
      {".txt", "text/plain; charset=utf-8"},     {".webmanifest", "application/manifest+json"}};
  return known;
}

std::string gzipped(const std::string& bytes) {
  z_stream stream{};
  POCD_CHECK(deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string out(deflateBound(&stream, bytes.size()) + 32, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int result = deflate(&stream, Z_FINISH);
  out.resize(out.size() - stream.avail_out);
  deflateEnd(&stream);
  POCD_CHECK(result == Z_STREAM_END);
  return out.size() < bytes.size() ? out : "";
}

}  // namespace

StaticFiles::StaticFiles(const std::filesystem::path& folder) {
  std::error_code error;
  for (auto entry = std::filesystem::recursive_directory_iterator(folder, error);
       !error && entry != std::filesystem::recursive_directory_iterator(); entry.increment(error)) {
    if (!entry->is_regular_file()) continue;
    const std::filesystem::path& file = entry->path();
    const auto type = types().find(file.extension().string());
    if (type == types().end()) throw InputError(file.string() + ": is no file of a page");
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    if (!in) throw InputError(file.string() + ": cannot be read");
    StaticFile& stored = files_["/" + file.lexically_relative(folder).generic_string()];
    stored.bytes = text.str();
    stored.gzip = gzipped(stored.bytes);
    stored.type = type->second;
    const uLong crc = crc32(0, reinterpret_cast<const Bytef*>(stored.bytes.data()),
                            static_cast<uInt>(stored.bytes.size()));
    stored.tag = '"' + std::to_string(crc) + '-' + std::to_string(stored.bytes.size()) + '"';
  }
  if (files_.count("/index.html") == 0) throw InputError(folder.string() + ": has no index.html");
  files_["/"] = files_["/index.html"];
}

const StaticFile* StaticFiles::find(const std::string& path) const {
  const auto found = files_.find(path);
  return found == files_.end() ? nullptr : &found->second;
}

std::filesystem::path StaticFiles::installed() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return program.parent_path().parent_path() / "share" / "pocd_view" / "page";
}

}  // namespace pocd::view

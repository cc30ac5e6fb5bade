// The page's files, read once: what is asked for later is looked up here and never on the disk.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace pocd::view {

struct StaticFile {
  std::string bytes, gzip;  ///< gzip is empty where it is no shorter
  std::string type;         ///< MIME
  std::string tag;          ///< of this content, for If-None-Match
};

class StaticFiles {
 public:
  /// All files below `folder`, by their path with '/' in front; "/" is index.html. Throws
  /// InputError naming the folder when there is no index.html, and the file that cannot be read or
  /// has an ending that is no page's.
  explicit StaticFiles(const std::filesystem::path& folder);

  /// `path` as in a request, without the query; null when there is no such file.
  const StaticFile* find(const std::string& path) const;
  /// pocd_view's page, beside the program that runs: ../share/pocd_view/page.
  static std::filesystem::path installed();

 private:
  std::map<std::string, StaticFile> files_;
};

}  // namespace pocd::view

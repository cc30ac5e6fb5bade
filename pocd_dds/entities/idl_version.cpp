#include "pocd_dds/entities/idl_version.hpp"

#include <algorithm>
#include <cstdio>
#include <mutex>

#include "pocd_dds/entities/known_types.hpp"

namespace pocd::dds {
namespace {

constexpr const char* kOurs = "pocd_msgs::";
constexpr const char* kKey = "pocd_idl=";
constexpr std::size_t kDigits = 16;

/// FNV-1a, 64 bit (Fowler, Noll, Vo): versions are to differ, not to withstand an attack.
std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  char digits[kDigits + 1];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
  return digits;
}

std::string version_in(const recording::IdlLibrary& library, const std::string& type) {
  const std::string name = plain_type(type);
  if (name.rfind(kOurs, 0) != 0 || !library.has(name)) return "";
  return hash_of(library.omgidl(name).text);
}

}  // namespace

std::string idl_version(const std::string& type) {
  static std::mutex mutex;
  static std::map<std::string, std::string> known;
  if (type.rfind(kOurs, 0) != 0) return "";
  const std::lock_guard<std::mutex> lock(mutex);
  const auto entry = known.find(type);
  if (entry != known.end()) return entry->second;
  // Names of other types of the module come from peers, and are not kept.
  const std::string version = version_in(known_types(), type);
  if (!version.empty()) known[type] = version;
  return version;
}

std::string idl_version(const std::string& type, const std::map<std::string, std::string>& files) {
  return version_in(recording::IdlLibrary(files), type);
}

std::vector<std::uint8_t> idl_announcement(const std::string& type) {
  const std::string version = idl_version(type);
  if (version.empty()) return {};
  const std::string text = kKey + version + ";";
  return {text.begin(), text.end()};
}

std::optional<std::string> announced_idl(const std::vector<std::uint8_t>& user_data) {
  const std::string text(user_data.begin(), user_data.end());
  const std::size_t key = text.find(kKey);
  if (key == std::string::npos) return std::nullopt;
  const std::size_t begin = key + std::string(kKey).size();
  const std::size_t end = text.find(';', begin);
  if (end == std::string::npos) return std::nullopt;
  // What is longer is no version, and a peer's text.
  return text.substr(begin, std::min(end - begin, kDigits));
}

}  // namespace pocd::dds

#include "pocd/input/class_map.hpp"

#include <algorithm>
#include <charconv>

namespace pocd {
namespace {

const ClassInfo* find(const std::vector<ClassInfo>& list, ClassId id) {
  const auto it = std::find_if(list.begin(), list.end(), [&](const auto& c) { return c.id == id; });
  return it == list.end() ? nullptr : &*it;
}

}  // namespace

std::optional<std::array<std::uint8_t, 3>> parse_rgb(const std::string& text) {
  std::array<std::uint8_t, 3> rgb{};
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    if (i > 0 && (at == end || *at++ != ',')) return std::nullopt;
    while (at != end && *at == ' ') ++at;
    const auto [next, error] = std::from_chars(at, end, rgb[i]);
    if (error != std::errc{}) return std::nullopt;
    at = next;
  }
  if (at != end) return std::nullopt;
  return rgb;
}

bool ClassMap::fits_a_pixel(int id) const {
  return std::int64_t{id} * label_divisor + label_divisor - 1 <= 65535;
}

std::vector<std::string> ClassMap::inconsistencies() const {
  std::vector<std::string> problems;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string entry = "list[" + std::to_string(i) + "]";
    const auto rgb = parse_rgb(list[i].rgb);
    if (!list[i].rgb.empty() && !rgb) {
      problems.push_back(entry + ".rgb: \"" + list[i].rgb +
                         "\" is no colour \"r,g,b\" of 0 to 255");
    }
    if (!fits_a_pixel(list[i].id)) {
      problems.push_back(entry + ".id: " + std::to_string(list[i].id) + " with label_divisor " +
                         std::to_string(label_divisor) + " is beyond the 16 bits of a pixel");
    }
    for (std::size_t j = 0; j < i; ++j) {
      const std::string earlier = "list[" + std::to_string(j) + "]";
      if (list[i].id == list[j].id) {
        problems.push_back(entry + ".id: " + std::to_string(list[i].id) + " is that of " + earlier);
      }
      if (rgb && rgb == parse_rgb(list[j].rgb)) {
        problems.push_back(entry + ".rgb: \"" + list[i].rgb + "\" is that of " + earlier);
      }
    }
  }
  return problems;
}

ClassRole ClassMap::role(ClassId id) const {
  const ClassInfo* info = find(list, id);
  if (!info && id == kThing) return ClassRole::kObject;
  return info ? info->role : ClassRole::kBackground;
}

int ClassMap::stationarity_class(ClassId id) const {
  const ClassInfo* info = find(list, id);
  if (!info && id == kThing) return 0;
  return info ? info->stationarity_class : 1;
}

std::string ClassMap::name(ClassId id) const {
  const ClassInfo* info = find(list, id);
  if (!info && id == kThing) return "thing";
  return info && !info->name.empty() ? info->name : "class_" + std::to_string(id);
}

ClassTable::ClassTable(const ClassMap& map) {
  int highest = map.default_class;
  for (const ClassInfo& info : map.list) highest = std::max(highest, info.id);
  for (int id = 0; id <= highest; ++id) {
    const ClassInfo* info = find(map.list, static_cast<ClassId>(id));
    int first = id;
    if (info && !info->name.empty()) {
      first = std::find_if(map.list.begin(), map.list.end(), [&](const ClassInfo& c) {
                return c.name == info->name;
              })->id;
    }
    canonical_.push_back(static_cast<ClassId>(first));
    role_.push_back(map.role(static_cast<ClassId>(id)));
  }
}

}  // namespace pocd

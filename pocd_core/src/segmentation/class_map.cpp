#include "pocd/segmentation/class_map.hpp"

#include <algorithm>

#include "pocd/segmentation/organized_cloud.hpp"

namespace pocd {
namespace {

const ClassInfo* find(const std::vector<ClassInfo>& list, ClassId id) {
  const auto it = std::find_if(list.begin(), list.end(), [&](const auto& c) { return c.id == id; });
  return it == list.end() ? nullptr : &*it;
}

ClassRole parse_role(const std::string& role) {
  if (role == "ground") return ClassRole::kGround;
  if (role == "object") return ClassRole::kObject;
  if (role == "dynamic") return ClassRole::kDynamic;
  if (role == "ignore") return ClassRole::kIgnore;
  return ClassRole::kBackground;
}

}  // namespace

ClassRole ClassMap::role(ClassId id) const {
  const ClassInfo* info = find(list, id);
  return info ? parse_role(info->role) : ClassRole::kBackground;
}

int ClassMap::stationarity_class(ClassId id) const {
  const ClassInfo* info = find(list, id);
  return info ? info->stationarity_class : 1;
}

std::string ClassMap::name(ClassId id) const {
  const ClassInfo* info = find(list, id);
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

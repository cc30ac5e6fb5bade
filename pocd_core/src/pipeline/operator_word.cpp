#include "pocd/pipeline/operator_word.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "operator_acts.hpp"
#include "pocd/common/check.hpp"

namespace pocd {
namespace {

bool has_polygon(WordKind kind) {
  return kind == WordKind::kForgetRegion || kind == WordKind::kIgnoreRegion;
}

bool has_object(WordKind kind) {
  return kind == WordKind::kForgetObject || kind == WordKind::kConfirmRemoval;
}

/// One line of readable text.
std::optional<std::string> wrong_text(const char* field, const std::string& text) {
  if (text.empty()) return std::string(field) + " is empty";
  if (text.size() > OperatorWord::kMostText) {
    return std::string(field) + " has " + std::to_string(text.size()) + " bytes, at most " +
           std::to_string(OperatorWord::kMostText) + " are taken";
  }
  const bool control = std::any_of(text.begin(), text.end(),
                                   [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  if (control) return std::string(field) + " holds control characters";
  return std::nullopt;
}

std::optional<std::string> wrong_polygon(const Polygon& polygon) {
  if (polygon.size() < 3 || polygon.size() > OperatorWord::kMostCorners) {
    return "polygon has " + std::to_string(polygon.size()) + " corners, 3 to " +
           std::to_string(OperatorWord::kMostCorners) + " are taken";
  }
  for (const Eigen::Vector2d& corner : polygon) {
    if (!(corner.cwiseAbs().maxCoeff() <= OperatorWord::kFarthest_m)) {  // nor for NaN
      return std::string("polygon has a corner that is no place in the map");
    }
  }
  return std::nullopt;
}

std::optional<std::string> why_not(const OperatorWord& word, const WordParts& parts) {
  if (const auto wrong = wrong_text("by", word.by)) return wrong;
  if (has_polygon(word.kind)) {
    if (const auto wrong = wrong_polygon(word.polygon_W)) return wrong;
  }
  if (word.kind == WordKind::kIgnoreRegion || word.kind == WordKind::kHeedRegion) {
    if (const auto wrong = wrong_text("region", word.region)) return wrong;
    const bool known = parts.ignored.has(word.region);
    if (word.kind == WordKind::kHeedRegion && !known) {
      return "region \"" + word.region + "\" is not ignored";
    }
    if (!known && parts.ignored.size() >= IgnoredRegions::kMost) {
      return std::to_string(IgnoredRegions::kMost) + " regions are ignored already";
    }
  }
  if (has_object(word.kind)) {
    const LibraryObject* object = parts.tracker.library().find(word.object);
    if (!object || !object->confirmed) {
      return "object " + std::to_string(to_index(word.object)) + " is not known";
    }
  }
  return std::nullopt;
}

OrientedBox bounds_of(const Polygon& polygon) {
  OrientedBox box;
  if (polygon.empty()) return box;
  Eigen::Vector2d low = polygon.front(), high = low;
  for (const Eigen::Vector2d& corner : polygon) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  box.pose.position_W.head<2>() = 0.5 * (low + high);
  box.size_m.head<2>() = high - low;
  return box;
}

/// Number of objects that were known to others.
std::size_t forget_objects(const std::function<bool(const Eigen::Vector2d&)>& inside,
                           const ObjectTracker::Said& said, const WordParts& parts,
                           FrameResult& result) {
  std::vector<ObjectId> ids;
  for (const auto& [id, object] : parts.tracker.library().all()) {
    if (inside(object->box.pose.position_W.head<2>())) ids.push_back(id);
  }
  MapEdits edits;
  for (const ObjectId id : ids) parts.tracker.forget(id, said, edits, result);
  edits.apply_to(parts.map);
  return result.retired.size();
}

std::string counted(std::size_t n, const char* what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

std::string forget_region(const Polygon& polygon, const ObjectTracker::Said& said,
                          const WordParts& parts, FrameResult& result) {
  const auto inside = [&](const Eigen::Vector2d& p) { return is_inside(polygon, p); };
  const std::size_t objects = forget_objects(inside, said, parts, result);
  const OrientedBox box = bounds_of(polygon);
  const Eigen::Vector2d middle = box.pose.position_W.head<2>(), half = 0.5 * box.size_m.head<2>();
  const std::size_t voxels = parts.map.clear_column(middle - half, middle + half, inside);
  parts.tracker.forget_places(inside);
  return counted(objects, "object") + " and " + counted(voxels, "voxel") + " forgotten";
}

std::string reset(const ObjectTracker::Said& said, const WordParts& parts, FrameResult& result) {
  parts.map.clear();  // may refuse, before anything has changed
  const auto all = [](const Eigen::Vector2d&) { return true; };
  const std::size_t objects = forget_objects(all, said, parts, result);
  parts.tracker.forget_places(all);
  parts.grounds.clear();
  return counted(objects, "object") + " and the map forgotten";
}

}  // namespace

const char* to_string(WordKind kind) {
  static const char* const names[kWordKinds] = {"forget_object", "forget_region", "reset",
                                                "ignore_region", "heed_region",   "confirm_removal",
                                                "save"};
  return names[static_cast<int>(kind)];
}

WordOutcome follow(const OperatorWord& word, const WordParts& parts) {
  WordOutcome outcome;
  if (const auto reason = why_not(word, parts)) {
    outcome.text = std::string(to_string(word.kind)) + ": " + *reason;
    return outcome;
  }
  const std::string rule = to_string(word.kind);
  const ObjectTracker::Said said{word.by, rule, parts.stamp_ns};
  FrameResult& result = outcome.result;
  MapEdits edits;
  OrientedBox where = bounds_of(has_polygon(word.kind) ? word.polygon_W : Polygon());
  if (has_object(word.kind)) where = parts.tracker.library().find(word.object)->box;
  std::string noted = rule;
  try {
    switch (word.kind) {
      case WordKind::kForgetObject:
        parts.tracker.forget(word.object, said, edits, result);
        outcome.text = "1 object forgotten";
        break;
      case WordKind::kForgetRegion:
        outcome.text = forget_region(word.polygon_W, said, parts, result);
        break;
      case WordKind::kReset:
        outcome.text = reset(said, parts, result);
        break;
      case WordKind::kIgnoreRegion:
        parts.ignored.add(word.region, word.polygon_W);
        noted += " " + word.region;
        outcome.text = counted(parts.ignored.size(), "region") + " ignored";
        break;
      case WordKind::kHeedRegion:
        parts.ignored.remove(word.region);
        noted += " " + word.region;
        outcome.text = counted(parts.ignored.size(), "region") + " ignored";
        break;
      case WordKind::kConfirmRemoval:
        parts.tracker.confirm_removal(word.object, said, edits, result);
        outcome.text = "1 object removed";
        break;
      case WordKind::kSave:
        outcome.text = "saved";
        break;
    }
  } catch (const InputError& error) {
    outcome.text = rule + ": " + error.what();
    return outcome;
  }
  edits.apply_to(parts.map);
  parts.tracker.note({word.by, noted, parts.stamp_ns}, where, result);
  std::sort(result.retired.begin(), result.retired.end());
  outcome.done = true;
  return outcome;
}

}  // namespace pocd

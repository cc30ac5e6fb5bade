// What a class index of the segmentation means. The label map is configuration, never code: data
// sets order the same classes differently.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pocd/common/describe.hpp"
#include "pocd/common/types.hpp"

namespace pocd {

/// What the pipeline does with the pixels of a class.
enum class ClassRole {
  kBackground,  ///< mapped, never an object (walls, shelving bolted down, ceiling)
  kGround,      ///< mapped, removed before clustering
  kObject,      ///< tracked with a belief
  kDynamic,     ///< moves by itself (people, trucks): neither mapped nor tracked
  kIgnore,      ///< not used at all (the robot's own body)
};
inline EnumWords<ClassRole> words_of(ClassRole) {
  return {{ClassRole::kBackground, "background"},
          {ClassRole::kGround, "ground"},
          {ClassRole::kObject, "object"},
          {ClassRole::kDynamic, "dynamic"},
          {ClassRole::kIgnore, "ignore"}};
}

/// What a robot sees that never sends masks.
enum class WithoutMasks {
  kThings,        ///< what geometry tells to be movable is a thing (kThing)
  kDefaultClass,  ///< every pixel has the default class
};
inline EnumWords<WithoutMasks> words_of(WithoutMasks) {
  return {{WithoutMasks::kThings, "things"}, {WithoutMasks::kDefaultClass, "default_class"}};
}

/// Class of what geometry alone tells to be a thing, seen by a robot that sends no masks: movable,
/// named "thing".
inline constexpr ClassId kThing = 65535;

/// "r,g,b" with values 0 to 255; nothing for any other text.
std::optional<std::array<std::uint8_t, 3>> parse_rgb(const std::string& text);

struct ClassInfo {
  int id = 0;
  std::string name;
  ClassRole role = ClassRole::kBackground;
  int stationarity_class = 1;  ///< s: 0 dynamic/movable, 1 static
  std::string rgb = "";        ///< colour of the class in rgb8 masks, "r,g,b"; empty: none

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("id", id, Range{0, 65535}, "Class index in mono8 and mono16 segmentation images.");
    visit("name", name, "Name in outputs.");
    visit("role", role, "What the pipeline does with its pixels.");
    visit("stationarity_class", stationarity_class, Range{0, 1}, "s: 0 movable, 1 static.");
    visit("rgb", rgb, "Colour in rgb8/bgr8 segmentation images as \"r,g,b\"; empty for none.");
  }
};

struct ClassMap {
  /// Class of every pixel of a frame that has no segmentation image.
  int default_class = 0;
  WithoutMasks without_masks = WithoutMasks::kThings;
  /// Pixel value = class * label_divisor + instance; 1: the value is the class.
  int label_divisor = 1;
  std::vector<ClassInfo> list;

  /// Role of a class; classes not listed are background.
  ClassRole role(ClassId id) const;
  int stationarity_class(ClassId id) const;
  std::string name(ClassId id) const;  ///< "class_<id>" when not listed

  /// Whether every instance of the class has a value of 16 bits.
  bool fits_a_pixel(int id) const;

  /// Rules between the entries that are broken: an index or a colour listed twice, a colour that is
  /// none, an index that the divisor leaves no value for. Checked when a configuration is loaded.
  std::vector<std::string> inconsistencies() const;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit("default_class", default_class, Range{0, 65535},
          "Class of all pixels when no segmentation image is there.");
    visit("without_masks", without_masks,
          "Of a robot that never sends masks: what geometry tells to be movable is a thing (class "
          "65535), or every pixel has the default class.");
    visit("label_divisor", label_divisor, Range{1, 65535},
          "Pixel value = class * label_divisor + instance (panoptic masks); 1 = the value is the "
          "class.");
    visit("list", list, "The classes; those not listed are background.");
  }
};

/// ClassMap as a table for pixel loops. Two classes with one name are one class: the one listed
/// first (masks of one kind of thing may alias between two indices).
class ClassTable {
 public:
  explicit ClassTable(const ClassMap& map);
  ClassId canonical(ClassId id) const { return id < canonical_.size() ? canonical_[id] : id; }
  ClassRole role(ClassId id) const {
    return id < role_.size() ? role_[id] : ClassRole::kBackground;
  }

 private:
  std::vector<ClassId> canonical_;
  std::vector<ClassRole> role_;
};

}  // namespace pocd

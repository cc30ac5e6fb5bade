#include "pocd/input/class_map.hpp"

#include <gtest/gtest.h>

#include "pocd/segmentation/organized_cloud.hpp"
#include "test_room.hpp"

namespace pocd {
namespace {

TEST(ClassMap, UnlistedClassesAreStaticBackground) {
  const ClassMap map = test::room_classes();
  EXPECT_EQ(map.role(99), ClassRole::kBackground);
  EXPECT_EQ(map.stationarity_class(99), 1);
  EXPECT_EQ(map.name(99), "class_99");
  EXPECT_EQ(map.role(test::kBoxClass), ClassRole::kObject);
  EXPECT_EQ(map.stationarity_class(test::kBoxClass), 0);
  EXPECT_EQ(map.name(test::kBoxClass), "box");
}

TEST(ClassMap, NamesEveryBrokenRule) {
  ClassMap map = test::room_classes();
  EXPECT_TRUE(map.inconsistencies().empty());
  map.list[1].rgb = "1,2,3";
  map.list[2].rgb = "1, 2, 3";  // the same colour
  map.list[3].rgb = "1,2,256";  // none
  map.list[5].id = map.list[0].id;
  const auto problems = map.inconsistencies();
  ASSERT_EQ(problems.size(), 3u);
  EXPECT_NE(problems[0].find("list[2].rgb"), std::string::npos) << problems[0];
  EXPECT_NE(problems[1].find("list[3].rgb"), std::string::npos) << problems[1];
  EXPECT_NE(problems[2].find("list[5].id"), std::string::npos) << problems[2];
}

TEST(ParseRgb, TakesThreeBytesAndNothingElse) {
  EXPECT_EQ(parse_rgb("0,153,255"), (std::array<std::uint8_t, 3>{0, 153, 255}));
  EXPECT_EQ(parse_rgb("7, 8, 9"), (std::array<std::uint8_t, 3>{7, 8, 9}));
  for (const char* text : {"", "1,2", "1,2,3,4", "1,2,256", "-1,2,3", "1;2;3", "a,b,c", "1,2,3x"}) {
    EXPECT_FALSE(parse_rgb(text)) << text;
  }
}

TEST(ClassTable, EqualNamesAreOneClass) {
  const ClassMap map = test::room_classes();
  const ClassTable table(map);
  EXPECT_EQ(table.canonical(test::kFenceAlias), test::kFenceClass);
  EXPECT_EQ(table.canonical(test::kFenceClass), test::kFenceClass);
  EXPECT_EQ(table.canonical(test::kBoxClass), test::kBoxClass);
  EXPECT_EQ(table.canonical(60000), 60000) << "not listed: itself";
  EXPECT_EQ(table.role(60000), ClassRole::kBackground);
}

TEST(ClassTable, TheOneListedFirstNamesTheClass) {
  ClassMap map = test::room_classes();
  std::swap(map.list[3], map.list[4]);  // the fence with index 5 before the one with index 4
  EXPECT_EQ(ClassTable(map).canonical(test::kFenceClass), test::kFenceAlias);
}

TEST(ClassTable, NamelessClassesStayApart) {
  ClassMap map;
  for (const int id : {2, 3}) {
    ClassInfo info;
    info.id = id;
    map.list.push_back(info);
  }
  EXPECT_EQ(ClassTable(map).canonical(3), 3);
}

}  // namespace
}  // namespace pocd

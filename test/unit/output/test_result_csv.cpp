#include <gtest/gtest.h>

#include "pocd/common/check.hpp"
#include "pocd/eval/change_report.hpp"
#include "pocd/output/result_csv.hpp"
#include "run_command.hpp"

namespace pocd {
namespace {

ObjectEvent moved_event() {
  ObjectEvent event;
  event.sequence = 3;
  event.kind = EventKind::kMoved;
  event.object = ObjectId{12};
  event.class_id = 7;
  event.stamp_ns = 1500000000;
  event.box.pose.position_W = {1.25, -2.5, 0.75};
  event.previous_box = OrientedBox{};
  event.previous_box->pose.position_W = {0.5, -2.5, 0.75};
  event.evidence.rule = "relocated";
  return event;
}

TEST(ResultCsv, EventsReadBack) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "events.csv";
  EventsCsv csv(file);
  csv.add(moved_event(), "box, \"large\"");
  ObjectEvent removed = moved_event();
  removed.kind = EventKind::kRemoved;
  removed.previous_box.reset();
  csv.add(removed, "box\nof \"steel\"");
  csv.close();

  const std::vector<ReportedEvent> events = read_events_csv(file);
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::kMoved);
  EXPECT_EQ(events[0].object, 12u);
  EXPECT_EQ(events[0].class_name, "box, \"large\"");
  EXPECT_EQ(events[0].position_W, Eigen::Vector3d(1.25, -2.5, 0.75));
  ASSERT_TRUE(events[0].previous_W);
  EXPECT_EQ(*events[0].previous_W, Eigen::Vector3d(0.5, -2.5, 0.75));
  EXPECT_EQ(events[1].kind, EventKind::kRemoved);
  EXPECT_FALSE(events[1].previous_W);
  EXPECT_EQ(events[1].class_name, "box of \"steel\"") << "a row is a line";
}

// Last, so that readers by position go on.
TEST(ResultCsv, AddedHasItsArrivalInTheLastColumn) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "events.csv";
  EventsCsv csv(file);
  ObjectEvent event = moved_event();
  csv.add(event, "box");
  event.kind = EventKind::kAdded;
  for (const Arrival arrival : {Arrival::kUnknown, Arrival::kFound, Arrival::kArrived}) {
    event.arrival = arrival;
    csv.add(event, "box");
  }
  csv.close();
  std::istringstream text(read_text(file));
  std::vector<std::string> last;
  for (std::string line; std::getline(text, line);)
    last.push_back(line.substr(line.rfind(',') + 1));
  EXPECT_EQ(last, (std::vector<std::string>{"arrival", "", "unknown", "found", "arrived"}));
}

TEST(ResultCsv, ObjectsHaveOneCellPerColumn) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "objects.csv";
  ObjectSnapshot object;
  object.id = ObjectId{5};
  object.class_id = 7;
  object.box.size_m = {1.0, 0.5, 2.0};
  object.last_robot = "robot1";
  write_objects_csv(
      {object}, [](ClassId) { return "box"; }, file);
  const std::string text = read_text(file);
  const std::string row = text.substr(text.find('\n') + 1);
  EXPECT_EQ(
      row,
      "5,7,box,0,0.000000,0.000000,0.000000,0.000000,1.000000,0.500000,2.000000,0.000000,0.67,2.01,"
      "0.99,0,0.5,0,0,0,robot1\n");
  EXPECT_EQ(std::count(text.begin(), text.begin() + static_cast<long>(text.find('\n')), ','),
            std::count(row.begin(), row.end(), ','));
}

TEST(ResultCsv, UnwritableFileIsNamed) {
  const TemporaryFolder folder;
  try {
    const CsvFile csv(folder.path() / "absent/objects.csv", "a");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("absent/objects.csv"), std::string::npos);
  }
}

TEST(ResultCsv, FullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  CsvFile csv("/dev/full", "a");
  csv.row({"1"});
  EXPECT_THROW(csv.close(), InputError);
}

std::string read_error(const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "e.csv") << text;
  try {
    read_events_csv(folder.path() / "e.csv");
  } catch (const InputError& error) {
    const std::string what = error.what();
    return what.substr(what.find("e.csv"));
  }
  return "no error";
}

TEST(ResultCsv, BadEventFilesAreNamed) {
  const std::string header =
      "kind,object_id,class_name,x,y,z,previous_x,previous_y,previous_z,absorbed\n";
  EXPECT_EQ(read_error(header + "ADDED,1,box,0,0,0,,,,\n"), "no error");
  EXPECT_EQ(read_error(""), "e.csv: cannot be read or is empty");
  EXPECT_EQ(read_error(header + "ADDED,1,box\n"), "e.csv:2: 3 cells, the header has 10");
  EXPECT_EQ(read_error(header + "LOST,1,box,0,0,0,,,,\n"), "e.csv:2: kind \"LOST\" is unknown");
  EXPECT_EQ(read_error(header + "ADDED,1,box,0,0m,0,,,,\n"), "e.csv:2: y \"0m\" is no number");
  for (const std::string text : {"0x10", "nan", "inf", ""}) {
    EXPECT_EQ(read_error(header + "ADDED,1,box,0," + text + ",0,,,,\n"),
              "e.csv:2: y \"" + text + "\" is no number");
  }
  for (const std::string id : {"-1", "1.5", "1e20", "4294967296", "nan", ""}) {
    EXPECT_EQ(read_error(header + "ADDED," + id + ",box,0,0,0,,,,\n"),
              "e.csv:2: object_id \"" + id + "\" is no whole number of 32 bits");
  }
  EXPECT_EQ(read_error("kind\nADDED\n"), "e.csv:2: no column object_id");
}

}  // namespace
}  // namespace pocd

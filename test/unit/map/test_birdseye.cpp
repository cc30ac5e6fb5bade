#include "pocd/output/birdseye.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "map_fixtures.hpp"
#include "pocd/common/check.hpp"

namespace pocd::testing {
namespace {

// A horizontal square of side 1 m at height z, owned by one object.
void add_square(Mesh& mesh, double x, double y, double z, std::uint32_t owner) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_W.size());
  for (int i = 0; i < 4; ++i) {
    mesh.vertices_W.emplace_back(x + (i & 1), y + (i >> 1), z);
    mesh.owner.push_back(owner);
  }
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first + 1, first + 3, first + 2});
}

ObjectSnapshot object(std::uint32_t id, double x, double y, double score) {
  ObjectSnapshot o;
  o.id = ObjectId{id};
  o.box.pose.position_W = {x, y, 0.5};
  o.box.size_m = {1, 1, 1};
  o.belief.alpha = score;
  o.belief.beta = 1.0 - score;
  return o;
}

int count_near(const cv::Mat& image, const std::array<std::uint8_t, 3>& color) {
  int count = 0;
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols * 4 / 5; ++u) {  // without the legend
      const auto& p = image.at<cv::Vec3b>(v, u);
      count +=
          std::abs(p[0] - color[0]) + std::abs(p[1] - color[1]) + std::abs(p[2] - color[2]) < 45;
    }
  }
  return count;
}

TEST(Birdseye, ColoursRunFromRedOverYellowToGreen) {
  const auto red = stationarity_color(0), yellow = stationarity_color(0.5),
             green = stationarity_color(1);
  EXPECT_GT(red[2], 2 * red[1]);
  EXPECT_GT(yellow[2], 180);
  EXPECT_GT(yellow[1], 180);
  EXPECT_GT(green[1], green[2] * 2);
  EXPECT_EQ(stationarity_color(-3), red);
  EXPECT_EQ(stationarity_color(7), green);
}

TEST(Birdseye, ObjectsHaveTheColourOfTheirScoreAndLieWhereTheyAre) {
  Mesh mesh;
  for (int i = 0; i < 4; ++i) add_square(mesh, i - 1, 0, 0.0, 0);
  add_square(mesh, -1, 0, 1.0, 1);
  add_square(mesh, 2, 0, 1.0, 2);
  const cv::Mat image =
      draw_birdseye(mesh, {object(1, -0.5, 0.5, 0.05), object(2, 2.5, 0.5, 0.97)});
  EXPECT_LE(std::max(image.cols, image.rows), 1000);
  EXPECT_GE(std::max(image.cols, image.rows), 900);
  EXPECT_GT(count_near(image, stationarity_color(0.05)), 10000);
  EXPECT_GT(count_near(image, stationarity_color(0.97)), 10000);
  // The red one is on the left.
  EXPECT_GT(count_near(image.colRange(0, image.cols / 2), stationarity_color(0.05)), 5000);
}

using Color = std::array<std::uint8_t, 3>;
constexpr Color kRed{36, 28, 200}, kBlue{214, 96, 20};  // BGR, of changes

/// Smallest rectangle around the pixels of a colour, without the legend.
cv::Rect area_of(const cv::Mat& image, const Color& color) {
  std::vector<cv::Point> found;
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols - 104; ++u) {
      const auto& p = image.at<cv::Vec3b>(v, u);
      if (std::abs(p[0] - color[0]) + std::abs(p[1] - color[1]) + std::abs(p[2] - color[2]) < 24)
        found.emplace_back(u, v);
    }
  }
  return found.empty() ? cv::Rect() : cv::boundingRect(found);
}

OrientedBox box_at(double x, double y) {
  OrientedBox box;
  box.pose.position_W = {x, y, 0.5};
  box.size_m = {1, 1, 1};
  return box;
}

TEST(Birdseye, ChangesLieWhereTheyHappened) {
  Mesh mesh;
  for (int i = 0; i < 6; ++i) add_square(mesh, i, 0, 0.0, 0);
  add_square(mesh, 0, 0, 1.0, 1);  // green from x = 0 to 1: the measure of the picture
  const std::vector<ObjectSnapshot> objects{object(1, 0.5, 0.5, 1.0)};
  const cv::Mat plain = draw_birdseye(mesh, objects);
  const Color green = stationarity_color(1.0);
  const cv::Rect metre = area_of(plain, green);
  ASSERT_GT(metre.width, 50);
  EXPECT_EQ(area_of(plain, kRed).area(), 0);
  EXPECT_EQ(area_of(plain, kBlue).area(), 0);
  const auto near_x = [&](int pixel, double x_m) {  // a surface spreads by a pixel to each side
    EXPECT_NEAR(pixel, metre.x + 1 + x_m * (metre.width - 2), 5) << x_m << " m";
  };

  BirdseyeOptions options;
  options.changes = {{box_at(2.5, 0.5), std::nullopt}};  // is gone
  const cv::Rect gone = area_of(draw_birdseye(mesh, objects, options), kRed);
  near_x(gone.x, 2.0);
  near_x(gone.x + gone.width, 3.0);
  EXPECT_NEAR(gone.height, metre.height, 5);

  options.changes = {{box_at(2.5, 0.5), box_at(4.5, 0.5)}};  // moved: an arrow to the new place
  const cv::Rect moved = area_of(draw_birdseye(mesh, objects, options), kRed);
  near_x(moved.x, 2.0);
  near_x(moved.x + moved.width, 4.5);

  options.changes = {{std::nullopt, box_at(4.5, 0.5)}};  // new
  const cv::Mat picture = draw_birdseye(mesh, objects, options);
  const cv::Rect added = area_of(picture, kBlue);
  near_x(added.x, 4.0);
  near_x(added.x + added.width, 5.0);
  EXPECT_EQ(area_of(picture, kRed).area(), 0);
}

ObjectEvent event(EventKind kind, std::uint32_t id, StampNs stamp_ns, double x) {
  ObjectEvent e;
  e.kind = kind;
  e.object = ObjectId{id};
  e.stamp_ns = stamp_ns;
  e.box = box_at(x, 0);
  if (kind == EventKind::kMoved) e.previous_box = box_at(x - 1, 0);
  return e;
}

TEST(Birdseye, EventsOfOneObjectAreOneChange) {
  std::vector<ObjectEvent> events{
      event(EventKind::kAdded, 1, 1, 0),    event(EventKind::kAdded, 2, 1, 5),
      event(EventKind::kMoved, 1, 10, 1),   event(EventKind::kMoved, 1, 11, 2),
      event(EventKind::kUpdated, 1, 12, 3), event(EventKind::kAdded, 3, 13, 7),
      event(EventKind::kRemoved, 3, 14, 7), event(EventKind::kRemoved, 2, 15, 5),
      event(EventKind::kAdded, 4, 16, 8),   event(EventKind::kAdded, 5, 17, 9)};
  events.back().absorbed = ObjectId{4};
  const auto changes = changes_since(events, 10);
  ASSERT_EQ(changes.size(), 3u);
  EXPECT_EQ(changes[0].before->pose.position_W.x(), 0.0);  // 1: from the first place to the last
  EXPECT_EQ(changes[0].after->pose.position_W.x(), 3.0);
  EXPECT_EQ(changes[1].before->pose.position_W.x(), 5.0);  // 2: gone
  EXPECT_FALSE(changes[1].after);
  EXPECT_FALSE(changes[2].before);  // 5: new, and was called 4 before
  EXPECT_EQ(changes[2].after->pose.position_W.x(), 9.0);
  EXPECT_TRUE(changes_since(events, 18).empty());

  // New, gone, and found again elsewhere: it was nowhere before.
  const auto came_back =
      changes_since({event(EventKind::kAdded, 1, 10, 0), event(EventKind::kRemoved, 1, 11, 0),
                     event(EventKind::kMoved, 1, 12, 4)},
                    10);
  ASSERT_EQ(came_back.size(), 1u);
  EXPECT_FALSE(came_back[0].before);
  EXPECT_EQ(came_back[0].after->pose.position_W.x(), 4.0);
}

TEST(Birdseye, CeilingIsNotDrawn) {
  Mesh mesh;
  add_square(mesh, 0, 0, 0.0, 0);
  const cv::Mat without = draw_birdseye(mesh, {});
  add_square(mesh, 0, 0, 3.0, 0);
  EXPECT_EQ(cv::norm(without, draw_birdseye(mesh, {}), cv::NORM_INF), 0.0);
}

TEST(Birdseye, EmptyMapIsAPictureToo) {
  const cv::Mat image = draw_birdseye({}, {});
  EXPECT_GT(image.cols, 400);
  EXPECT_EQ(image.type(), CV_8UC3);
}

TEST(Birdseye, WritesAPngOrNamesTheFile) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / "pocd_test_birdseye.png";
  write_birdseye({}, {object(3, 0, 0, 0.5)}, file);
  EXPECT_FALSE(cv::imread(file.string()).empty());
  std::filesystem::remove(file);
  for (const char* bad : {"/nonexistent/a.png", "/tmp/a.unknown"}) {
    try {
      write_birdseye({}, {}, bad);
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(bad), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace pocd::testing

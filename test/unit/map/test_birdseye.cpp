#include "pocd/map/birdseye.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

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

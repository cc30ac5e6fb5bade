// What earlier states of a table know of a thing that is hidden now.
#include "pocd/eval/state_truth.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <sstream>

#include "../datasets/scratch_folder.hpp"

namespace pocd {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr double kFocal_px = 60.0;

struct Pixel {
  double depth_m;
  int label;
};

std::string pcd(const std::function<Pixel(int u, int v)>& at) {
  std::ostringstream out;
  out << "# .PCD v0.7\nVERSION 0.7\nFIELDS label x y z rgba\nSIZE 4 4 4 4 4\nTYPE U F F F U\n"
      << "COUNT 1 1 1 1 1\nWIDTH " << kWidth << "\nHEIGHT " << kHeight
      << "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << kWidth * kHeight << "\nDATA ascii\n";
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Pixel pixel = at(u, v);
      out << pixel.label << " 0 0 " << pixel.depth_m << " 0\n";
    }
  }
  return out.str();
}

StateTruth camera() {
  StateTruth truth;
  truth.camera.model = {kWidth, kHeight, kFocal_px, kFocal_px, 31.5, 23.5};
  return truth;
}

/// Centre of a patch of pixels [u0, u1) x [v0, v1) at a depth.
TruthThing patch(int state, int u0, int u1, int v0, int v1, double depth_m) {
  return {state, (0.5 * (u0 + u1 - 1) - 31.5) / kFocal_px * depth_m,
          (0.5 * (v0 + v1 - 1) - 23.5) / kFocal_px * depth_m, depth_m};
}

bool within(int u, int v, int u0, int u1, int v0, int v1) {
  return u >= u0 && u < u1 && v >= v0 && v < v1;
}

const Pixel kTable{1.2, 1};

/// A thing of 24 x 20 pixels at 1 m; then another one at 0.8 m in front of columns up to `cover`.
std::vector<ExpectedState> states(int cover, bool still_there) {
  const ScratchFolder folder;
  folder.write("0.pcd", pcd([](int u, int v) {
                 return within(u, v, 20, 44, 14, 34) ? Pixel{1.0, 20} : kTable;
               }));
  folder.write("1.pcd", pcd([&](int u, int v) {
                 if (within(u, v, 18, cover, 12, 36)) return Pixel{0.8, 30};
                 return still_there && within(u, v, 20, 44, 14, 34) ? Pixel{1.0, 20} : kTable;
               }));
  StateTruth truth = camera();
  truth.objects = {patch(0, 20, 44, 14, 34, 1.0), patch(1, 18, cover, 12, 36, 0.8)};
  if (still_there && cover < 44) truth.objects.push_back(patch(1, cover, 44, 14, 34, 1.0));
  return expected_states(truth, folder.path());
}

TEST(StateTruth, APixelAtAnOutlineContradictsNothing) {
  // 96 % of the thing are hidden; its last column, at the outline of what hides it, shows the table.
  const auto now = states(43, false).at(1);
  ASSERT_EQ(now.objects.size(), 1u);
  ASSERT_EQ(now.hidden.size(), 1u);
  EXPECT_NEAR(now.hidden[0].listed_W.z(), 1.0, 1e-9);
}

TEST(StateTruth, AThingThatIsSeenThroughIsGone) {
  // A quarter of the thing's place shows the table, far from any outline; then all of it.
  EXPECT_TRUE(states(38, false).at(1).hidden.empty());
  EXPECT_TRUE(states(19, false).at(1).hidden.empty());
}

TEST(StateTruth, AThingThatIsHiddenInPartKeepsItsEarlierCentre) {
  const auto now = states(32, true).at(1);
  ASSERT_EQ(now.objects.size(), 2u);
  EXPECT_TRUE(now.hidden.empty());
  ASSERT_EQ(now.objects[1].earlier_W.size(), 1u);
  EXPECT_NEAR((now.objects[1].earlier_W[0] - patch(0, 20, 44, 14, 34, 1.0).center_W()).norm(), 0.0,
              1e-9);
}

}  // namespace
}  // namespace pocd

// TimeSynchronizer: which frames come out, with what, and what is said about those that do not.
#include "pocd/input/time_synchronizer.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "pocd/common/random.hpp"

namespace pocd {
namespace {

using Stream = TimeSynchronizer::Stream;
constexpr StampNs kMs = 1'000'000;

class Synchronizer : public ::testing::Test {
 protected:
  Synchronizer() {
    config_.camera_frame = "camera";
    tree_.set_static("base", "camera", PoseQuaternion{});
  }
  static cv::Mat image(int value) { return cv::Mat(2, 2, CV_16UC1, cv::Scalar(value)); }
  static CameraModel camera(double fx = 100) { return {2, 2, fx, 100, 1, 1}; }
  void pose(TimeSynchronizer& sync, StampNs stamp_ns) {
    PoseQuaternion T;
    T.position.x() = static_cast<double>(stamp_ns) * 1e-9;
    sync.pose_seen(stamp_ns, tree_.add("map", "base", stamp_ns, T));
  }

  SynchronizerConfig config_;
  TransformTree tree_{1000 * kMs};
};

TEST_F(Synchronizer, CompletesAFrameWhicheverStreamComesLast) {
  std::vector<int> order{0, 1, 2, 3};
  do {
    TransformTree tree(1000 * kMs);
    tree.set_static("base", "camera", PoseQuaternion{});
    TimeSynchronizer sync(config_, tree);
    for (std::size_t i = 0; i < order.size(); ++i) {
      EXPECT_TRUE(sync.take().empty());
      if (order[i] == 0) sync.add_image(Stream::kDepth, 100 * kMs, image(7));
      if (order[i] == 1) sync.add_image(Stream::kSegmentation, 100 * kMs, image(3));
      if (order[i] == 2) sync.add_camera_info(100 * kMs, camera());
      if (order[i] == 3) {
        tree.add("map", "base", 90 * kMs,
                 PoseQuaternion{{1, 0, 0}, Eigen::Quaterniond::Identity()});
        tree.add("map", "base", 110 * kMs,
                 PoseQuaternion{{2, 0, 0}, Eigen::Quaterniond::Identity()});
      }
    }
    const auto frames = sync.take();
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].depth.at<std::uint16_t>(0, 0), 7);
    EXPECT_EQ(frames[0].labels.at<std::uint16_t>(0, 0), 3);
    EXPECT_DOUBLE_EQ(frames[0].T_W_C.translation().x(), 1.5);  // halfway: exact in binary
    EXPECT_EQ(sync.watermark_ns(), 100 * kMs);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST_F(Synchronizer, NamesTheStreamItWaitsFor) {
  TimeSynchronizer sync(config_, tree_);
  EXPECT_EQ(sync.waiting_for(), "");
  sync.add_image(Stream::kDepth, 2'000'000'005, image(1));
  sync.take();
  EXPECT_EQ(sync.waiting_for(), "waiting for camera_info since 2.000000005");
  sync.add_camera_info(2'000'000'005, camera());
  sync.take();
  EXPECT_EQ(sync.waiting_for(), "waiting for pose (? -> base) since 2.000000005");
  pose(sync, 1'990'000'000);
  sync.take();
  EXPECT_EQ(sync.waiting_for(), "waiting for pose (map -> base) since 2.000000005");
  pose(sync, 2'010'000'000);
  sync.take();
  EXPECT_EQ(sync.waiting_for(), "waiting for segmentation since 2.000000005");
}

TEST_F(Synchronizer, GoesOnWithoutOptionalSegmentationAfterTheBoundedWait) {
  TimeSynchronizer sync(config_, tree_);
  pose(sync, 0);
  sync.add_camera_info(100 * kMs, camera());
  sync.add_image(Stream::kDepth, 100 * kMs, image(1));
  pose(sync, 400 * kMs);  // exactly the wait: not over yet
  EXPECT_TRUE(sync.take().empty());
  pose(sync, 401 * kMs);
  const auto frames = sync.take();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_TRUE(frames[0].labels.empty());
  EXPECT_EQ(sync.counts().without_segmentation, 1u);
}

TEST_F(Synchronizer, DropsWithoutRequiredSegmentationAndKeepsOrder) {
  config_.segmentation = StreamUse::kRequired;
  TimeSynchronizer sync(config_, tree_);
  pose(sync, 0);
  pose(sync, 300 * kMs);
  for (StampNs stamp : {100 * kMs, 200 * kMs}) {
    sync.add_camera_info(stamp, camera());
    sync.add_image(Stream::kDepth, stamp, image(1));
  }
  EXPECT_TRUE(sync.take().empty());
  // Segmentation of the second frame proves that the first one's will not come.
  sync.add_image(Stream::kSegmentation, 200 * kMs, image(2));
  const auto frames = sync.take();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].stamp_ns, 200 * kMs);
  EXPECT_EQ(sync.counts().dropped_no_segmentation, 1u);
}

TEST_F(Synchronizer, AbsentSegmentationIsNotWaitedFor) {
  config_.segmentation = StreamUse::kAbsent;
  TimeSynchronizer sync(config_, tree_);
  pose(sync, 100 * kMs);
  sync.add_camera_info(100 * kMs, camera());
  sync.add_image(Stream::kDepth, 100 * kMs, image(1));
  EXPECT_EQ(sync.take().size(), 1u);
  EXPECT_EQ(sync.counts().without_segmentation, 0u);
}

TEST_F(Synchronizer, NeverExtrapolatesBeyondTheBound) {
  config_.segmentation = StreamUse::kAbsent;
  config_.extrapolation_ns = 20 * kMs;
  TimeSynchronizer sync(config_, tree_);
  pose(sync, 80 * kMs);
  sync.add_camera_info(100 * kMs, camera());
  sync.add_image(Stream::kDepth, 100 * kMs, image(1));
  EXPECT_TRUE(sync.take().empty()) << "a later pose may still come";
  sync.add_image(Stream::kDepth, 101 * kMs, image(1));
  const auto frames = sync.flush();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_DOUBLE_EQ(frames[0].T_W_C.translation().x(), 0.08);
  EXPECT_EQ(sync.counts().dropped_no_pose, 1u);
}

TEST_F(Synchronizer, PatientOneWaitsHoweverFarOthersRunAhead) {
  TimeSynchronizer sync(config_, tree_);
  sync.set_patience(Patience::kEndless);
  pose(sync, 100 * kMs);
  sync.add_camera_info(100 * kMs, camera());
  sync.add_image(Stream::kDepth, 100 * kMs, image(1));
  pose(sync, 90'000 * kMs);
  EXPECT_TRUE(sync.take().empty());
  sync.add_image(Stream::kSegmentation, 100 * kMs, image(2));
  EXPECT_EQ(sync.take().size(), 1u);
}

// A replay in which nobody sends labels: they are not waited for, the pose is.
TEST_F(Synchronizer, PatienceWithOneStreamIsNotPatienceWithAnother) {
  for (const Patience with_labels : {Patience::kBounded, Patience::kNone}) {
    TransformTree tree(1000 * kMs);
    tree.set_static("base", "camera", PoseQuaternion{});
    TimeSynchronizer sync(config_, tree);
    sync.set_patience(Patience::kEndless);
    sync.set_patience(Stream::kSegmentation, with_labels);
    const auto add = [&](StampNs stamp_ns) {
      sync.add_camera_info(stamp_ns, camera());
      sync.add_image(Stream::kDepth, stamp_ns, image(1));
      return sync.take().size();
    };
    EXPECT_EQ(add(100 * kMs), 0u);
    EXPECT_EQ(add(900 * kMs), 0u) << "further ahead than max_wait_ns";
    EXPECT_EQ(sync.blocked_by(), Stream::kPose);
    sync.pose_seen(100 * kMs, tree.add("map", "base", 100 * kMs, PoseQuaternion{}));
    EXPECT_EQ(sync.take().size(), 1u);
    EXPECT_EQ(sync.counts().without_segmentation, 1u);
    sync.pose_seen(900 * kMs, tree.add("map", "base", 900 * kMs, PoseQuaternion{}));
    EXPECT_EQ(sync.take().size(), with_labels == Patience::kNone ? 1u : 0u);
    EXPECT_EQ(sync.counts().dropped_no_pose, 0u);
  }
}

TEST_F(Synchronizer, RefusesStampsThatJumpBackwards) {
  TimeSynchronizer sync(config_, tree_);
  EXPECT_FALSE(sync.add_image(Stream::kDepth, 100, image(1)));
  for (const StampNs stamp_ns : {100, 99}) {
    const auto problem = sync.add_image(Stream::kDepth, stamp_ns, image(1));
    ASSERT_TRUE(problem);
    EXPECT_EQ(problem->reason, InputReason::kStampBackwards);
    EXPECT_EQ(problem->detail,
              "stamp " + std::to_string(stamp_ns) + " ns is not after the last one, 100 ns");
  }
  EXPECT_FALSE(sync.add_camera_info(100, camera()));
  EXPECT_TRUE(stamp_refused(sync.add_camera_info(50, camera())));
  EXPECT_EQ(sync.pending(), 1u);
}

// One stamp of each stream in turn lies in 2038; ten good ones later the frames come again, and the
// waiting ones are not late for ever.
TEST_F(Synchronizer, OneStampFarInTheFutureDoesNotMuteAStream) {
  constexpr StampNs kFar = 2'147'483'647'000 * kMs;
  for (const bool patient : {false, true}) {
    for (const Stream bad :
         {Stream::kDepth, Stream::kSegmentation, Stream::kCameraInfo, Stream::kPose}) {
      TransformTree tree(1000 * kMs);
      tree.set_static("base", "camera", PoseQuaternion{});
      TimeSynchronizer sync(config_, tree);
      sync.set_patience(patient ? Patience::kEndless : Patience::kBounded);
      int restarts = 0, refusals = 0, complete_late = 0;
      StampNs last_ns = 0;
      std::uint64_t depth_added = 0;
      const auto told = [&](const std::optional<InputProblem>& problem) {
        refusals += stamp_refused(problem);
        restarts += problem && problem->reason == InputReason::kStampsRestarted;
        return !stamp_refused(problem);
      };
      for (int i = 1; i <= 60; ++i) {
        const StampNs stamp_ns = i * 100 * kMs;
        const auto of = [&](Stream stream) { return i == 20 && stream == bad ? kFar : stamp_ns; };
        depth_added += told(sync.add_image(Stream::kDepth, of(Stream::kDepth), image(i)));
        told(sync.add_image(Stream::kSegmentation, of(Stream::kSegmentation), image(i)));
        told(sync.add_camera_info(of(Stream::kCameraInfo), camera()));
        const auto problem = tree.add("map", "base", of(Stream::kPose), PoseQuaternion{});
        told(problem);
        sync.pose_seen(of(Stream::kPose), problem);
        for (const SyncedFrame& frame : sync.take()) {
          EXPECT_GT(frame.stamp_ns, last_ns);
          last_ns = frame.stamp_ns;
          complete_late += i > 32 && frame.stamp_ns == stamp_ns && !frame.labels.empty();
        }
      }
      const std::string which = std::to_string(static_cast<int>(bad)) + (patient ? " patient" : "");
      EXPECT_EQ(complete_late, 28) << which << ": " << sync.waiting_for();
      EXPECT_EQ(refusals, StampOrder::kAgreeing - 1) << which;
      EXPECT_EQ(restarts, 1) << which;
      const SynchronizerCounts& counts = sync.counts();
      EXPECT_EQ(counts.dropped_restart, bad == Stream::kDepth ? 1u : 0u) << which;
      EXPECT_EQ(counts.complete + counts.dropped_no_pose + counts.dropped_no_camera_info +
                    counts.dropped_restart + sync.pending(),
                depth_added)
          << which;
    }
  }
}

// A clock that is set back by an hour: every stream starts anew, and the watermark with the depth.
TEST_F(Synchronizer, AClockThatIsSetBackIsFollowed) {
  TimeSynchronizer sync(config_, tree_);
  int frames = 0;
  StampNs watermark_ns = 0;
  for (int i = 1; i <= 60; ++i) {
    const StampNs stamp_ns = (i <= 30 ? 3'600'000 : 0) * kMs + i * 100 * kMs;
    sync.add_image(Stream::kDepth, stamp_ns, image(i));
    sync.add_image(Stream::kSegmentation, stamp_ns, image(i));
    sync.add_camera_info(stamp_ns, camera());
    pose(sync, stamp_ns);
    for (const SyncedFrame& frame : sync.take()) frames += i > 42 && frame.stamp_ns == stamp_ns;
    watermark_ns = stamp_ns;
  }
  EXPECT_EQ(frames, 18);
  EXPECT_EQ(sync.watermark_ns(), watermark_ns);
}

TEST_F(Synchronizer, UsesTheLastCameraInfoWhenItsOwnIsLate) {
  config_.segmentation = StreamUse::kAbsent;
  TimeSynchronizer sync(config_, tree_);
  pose(sync, 0);
  pose(sync, 600 * kMs);
  sync.add_camera_info(50 * kMs, camera(123));
  sync.add_image(Stream::kDepth, 100 * kMs, image(1));
  const auto frames = sync.take();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].camera.fx, 123);
}

// Whatever is lost and however it is interleaved: every depth image is accounted for once, frames
// come in order, and each has the segmentation of its own stamp.
TEST_F(Synchronizer, AccountsForEveryFrameUnderRandomLossAndOrder) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Random random(seed);
    config_.segmentation = seed % 2 ? StreamUse::kOptional : StreamUse::kRequired;
    TransformTree tree(1000 * kMs);
    tree.set_static("base", "camera", PoseQuaternion{});
    TimeSynchronizer sync(config_, tree);
    std::uint64_t depth_added = 0, emitted = 0;
    StampNs last_stamp = -1;
    const auto check = [&](const std::vector<SyncedFrame>& frames) {
      for (const SyncedFrame& frame : frames) {
        EXPECT_GT(frame.stamp_ns, last_stamp);
        last_stamp = frame.stamp_ns;
        ++emitted;
        const int index = static_cast<int>(frame.stamp_ns / (50 * kMs));
        EXPECT_EQ(frame.depth.at<std::uint16_t>(0, 0), index);
        if (!frame.labels.empty()) {
          EXPECT_EQ(frame.labels.at<std::uint16_t>(0, 0), index);
        }
      }
    };
    int next[4] = {0, 0, 0, 0};
    while (next[0] < 40 || next[1] < 40 || next[2] < 40 || next[3] < 40) {
      const auto stream = random.below(4);
      const int index = next[stream];
      if (index >= 40) continue;
      ++next[stream];
      if (random.uniform() < 0.15) continue;  // lost
      const StampNs stamp_ns = index * 50 * kMs;
      if (stream == 0) depth_added += !sync.add_image(Stream::kDepth, stamp_ns, image(index));
      if (stream == 1) sync.add_image(Stream::kSegmentation, stamp_ns, image(index));
      if (stream == 2) sync.add_camera_info(stamp_ns, camera());
      if (stream == 3) {
        sync.pose_seen(stamp_ns, tree.add("map", "base", stamp_ns, PoseQuaternion{}));
      }
      check(sync.take());
    }
    check(sync.flush());
    const SynchronizerCounts& counts = sync.counts();
    EXPECT_EQ(counts.complete, emitted);
    EXPECT_EQ(counts.complete + counts.dropped_no_segmentation + counts.dropped_no_camera_info +
                  counts.dropped_no_pose + counts.dropped_overflow,
              depth_added)
        << "seed " << seed;
    EXPECT_EQ(sync.pending(), 0u);
  }
}

}  // namespace
}  // namespace pocd

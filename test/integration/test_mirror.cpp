// Subscribers that come late, and publishers that go without a word.
#include <gtest/gtest.h>

#include "bus_harness.hpp"
#include "pocd_dds/map_mirror.hpp"

namespace pocd {
namespace {

MirrorOptions on(const TestDomain& domain) {
  MirrorOptions options;
  options.domain = domain.number();
  return options;
}

bool whole(const MirrorStatus& status) { return status.in_step && status.version > 0; }

TEST(Mirror, LateJoinerConvergesToTheSameDigest) {
  const TestDomain domain;
  Process node(node_command(domain, {"--lossless"}));
  MapMirror early(on(domain));
  ASSERT_EQ(run_command(play_command(domain, {"--max-frames", "90"})).exit_code, 0);
  ASSERT_TRUE(early.wait_until(whole, kGenerous));

  MapMirror late(on(domain));
  // Both follow to the very end of the run, whatever the node still had in its queue.
  ASSERT_TRUE(late.wait_until(whole, kGenerous));
  EXPECT_GT(late.status().snapshots_taken + late.status().gathered, 0u)
      << "deltas alone cannot have made this copy";
  node.signal(SIGINT);
  const auto finished = [](const MirrorStatus& status) { return status.final_version; };
  ASSERT_TRUE(early.wait_until(finished, kGenerous)) << early.status().stale_because;
  ASSERT_TRUE(late.wait_until(finished, kGenerous)) << late.status().stale_because;
  EXPECT_EQ(node.wait().exit_code, 0);
  EXPECT_EQ(late.status().digest, early.status().digest);
  EXPECT_EQ(late.status().tiles, early.status().tiles);
  EXPECT_EQ(late.status().objects, early.status().objects);
  EXPECT_GT(late.status().tiles, 0u);
}

TEST(Mirror, NewRunAfterAKilledPublisherIsNoticedAndTakenOver) {
  const TestDomain domain;
  MapMirror mirror(on(domain));
  {
    Process node(node_command(domain, {"--lossless", "--epoch", "1"}));
    ASSERT_EQ(run_command(play_command(domain, {"--max-frames", "60"})).exit_code, 0);
    ASSERT_TRUE(mirror.wait_until(whole, kGenerous));
    EXPECT_EQ(mirror.status().epoch, 1u);
    node.signal(SIGKILL);
    EXPECT_EQ(node.wait().exit_code, 128 + SIGKILL);
    // Noticed when the lease is over, although no word was said.
    ASSERT_TRUE(
        mirror.wait_until([](const MirrorStatus& status) { return !status.in_step; }, kGenerous));
    EXPECT_EQ(mirror.status().stale_because, "the publisher has gone without ending its run");
  }
  Process node(node_command(domain, {"--lossless", "--epoch", "2"}));
  ASSERT_EQ(run_command(play_command(domain, {"--max-frames", "60"})).exit_code, 0);
  EXPECT_TRUE(mirror.wait_until(
      [](const MirrorStatus& status) { return status.epoch == 2 && whole(status); }, kGenerous))
      << mirror.status().stale_because;
  node.signal(SIGINT);
  EXPECT_EQ(node.wait().exit_code, 0);
}

TEST(Mirror, WithoutAPublisherItSaysSo) {
  const TestDomain domain;
  const CommandResult result =
      run_command({bin("pocd_mirror"), "--until-end", "--timeout", "1", "--domain", domain.text()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.out.find("stale, because no publisher heard of yet"), std::string::npos);
}

}  // namespace
}  // namespace pocd

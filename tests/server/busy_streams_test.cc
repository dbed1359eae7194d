#include "server/compute/busy_streams.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <vector>

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kLate(10);
constexpr BusyStreams::Clock::time_point kStart{seconds(1000)};  // Start of a period.

TEST(BusyStreams, CountsEachStreamOnceHoweverManyFramesItSends) {
  BusyStreams busy(kLate);
  EXPECT_EQ(busy.Count(0, kStart), 0u);
  std::vector<BusyStreams::Mark> streams(3);
  for (int frame = 0; frame < 100; ++frame) {
    for (BusyStreams::Mark& stream : streams) {
      busy.Worked(stream, 1000, kStart + milliseconds(90 * frame));
    }
  }
  EXPECT_EQ(busy.Count(1000, kStart + seconds(9)), 3u);
}

TEST(BusyStreams, CountsAStreamByItsLargestFrame) {
  BusyStreams busy(kLate);
  std::vector<BusyStreams::Mark> streams(3);
  for (const std::size_t size : {1000, 1'000'000, 1000}) busy.Worked(streams[0], size, kStart);
  busy.Worked(streams[1], 1000, kStart);
  busy.Worked(streams[2], 10, kStart);
  EXPECT_EQ(busy.Count(1, kStart), 3u);
  EXPECT_EQ(busy.Count(1000, kStart), 2u);
  EXPECT_EQ(busy.Count(250'000, kStart), 1u);
  EXPECT_EQ(busy.Count(1 << 20, kStart), 0u);
}

TEST(BusyStreams, CountsTheStreamsThatGoOnWheneverItIsAsked) {
  BusyStreams busy(kLate);
  std::vector<BusyStreams::Mark> streams(4);
  for (int frame = 0; frame < 300; ++frame) {
    const auto now = kStart + milliseconds(125 * frame);
    busy.Worked(streams[frame % streams.size()], 1000, now);
    if (frame < 4) continue;
    EXPECT_EQ(busy.Count(1000, now), 4u) << frame;
  }
}

TEST(BusyStreams, ForgetsAStreamThatHasStopped) {
  BusyStreams busy(kLate);
  std::vector<BusyStreams::Mark> streams(2);
  for (BusyStreams::Mark& stream : streams) busy.Worked(stream, 1000, kStart);
  for (int second = 0; second < 20; ++second) {
    busy.Worked(streams[0], 1000, kStart + seconds(second));
    EXPECT_EQ(busy.Count(1000, kStart + seconds(second)), 2u) << second;
  }
  busy.Worked(streams[0], 1000, kStart + seconds(20));
  EXPECT_EQ(busy.Count(1000, kStart + seconds(20)), 1u);
}

TEST(BusyStreams, CountsNoneOfAPeriodLongAgoWhenOneBeginsAgain) {
  BusyStreams busy(kLate);
  std::vector<BusyStreams::Mark> streams(3);
  for (BusyStreams::Mark& stream : streams) busy.Worked(stream, 1000, kStart);
  const auto again = kStart + 5 * kLate;
  busy.Worked(streams[0], 1000, again);
  EXPECT_EQ(busy.Count(1000, again), 1u);
}

TEST(BusyStreams, ForgetsAllOnceNobodyHasHadSuchAFrameForLong) {
  BusyStreams busy(kLate);
  std::vector<BusyStreams::Mark> streams(2);
  busy.Worked(streams[0], 1'000'000, kStart);
  busy.Worked(streams[1], 1000, kStart + seconds(9));
  EXPECT_EQ(busy.Count(250'000, kStart + milliseconds(9999)), 1u);
  EXPECT_EQ(busy.Count(250'000, kStart + kLate), 0u);
  EXPECT_EQ(busy.Count(1000, kStart + seconds(18)), 2u);
  EXPECT_EQ(busy.Count(1000, kStart + seconds(19)), 0u);
}

}  // namespace
}  // namespace partiemc::server

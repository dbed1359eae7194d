#include "server/relay/finished_streams.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <utility>

#include "support/manual_clock.h"

namespace partiemc::server {
namespace {

relay::v1::LiveStream Named(const std::string& name, const std::string& lineage,
                            std::size_t label_bytes = 0) {
  relay::v1::LiveStream stream;
  stream.set_lineage(lineage);
  stream.mutable_summary()->set_stream_name(name);
  (*stream.mutable_summary()->mutable_labels())["note"] = std::string(label_bytes, 'a');
  return stream;
}

TEST(FinishedStreams, AreFoundByNameAndLineageForThirtySeconds) {
  support::ManualClock clock;
  FinishedStreams finished(clock);
  finished.Add(Named("tank", "first"), 7);
  clock.Advance(std::chrono::seconds(20));
  finished.Add(Named("tank", "second"), 8);
  EXPECT_EQ(finished.Find("tank", "first")->summary().last_sequence(), 7u);
  EXPECT_EQ(finished.Find("tank", "second")->summary().last_sequence(), 8u);
  finished.Add(Named("tank", ""), 9);
  EXPECT_FALSE(finished.Find("tank", "")) << "a first watch";
  EXPECT_FALSE(finished.Find("pond", "first"));
  finished.Add(Named("tank", "third"), 9);
  finished.Forget("third");
  EXPECT_FALSE(finished.Find("tank", "third"));
  clock.Advance(std::chrono::seconds(11));
  EXPECT_FALSE(finished.Find("tank", "first"));
  EXPECT_TRUE(finished.Find("tank", "second"));
}

TEST(FinishedStreams, DropTheOldestBeyondTheirBytes) {
  constexpr int kStreams = 100;
  constexpr std::size_t kLabelBytes = FinishedStreams::kMostBytes / 20;
  FinishedStreams finished;
  for (int k = 0; k < kStreams; ++k) {
    finished.Add(Named("tank", std::to_string(k), kLabelBytes), 1);
  }
  int kept = 0;
  for (int k = 0; k < kStreams; ++k) kept += finished.Find("tank", std::to_string(k)) ? 1 : 0;
  EXPECT_GT(kept, 10);
  EXPECT_LE(kept, 20);
  EXPECT_TRUE(finished.Find("tank", std::to_string(kStreams - 1)));
  finished.Add(Named("tank", "huge", 2 * FinishedStreams::kMostBytes), 1);
  EXPECT_FALSE(finished.Find("tank", "huge"));
  EXPECT_TRUE(finished.Find("tank", std::to_string(kStreams - 1)));
}

}  // namespace
}  // namespace partiemc::server

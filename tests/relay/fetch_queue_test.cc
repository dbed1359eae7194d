// Replicas take turns in the queue of fetches.
#include "server/relay/fetch_queue.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace partiemc::server {
namespace {

relay::v1::Fetch FetchOf(std::uint64_t number, const std::string& stream = "s") {
  relay::v1::Fetch fetch;
  fetch.set_stream_id(stream);
  fetch.set_fetch(number);
  return fetch;
}

TEST(FetchQueue, ReplicasTakeTurns) {
  FetchQueue queue;
  for (std::uint64_t k = 1; k <= 3; ++k) queue.Add("a", FetchOf(k));
  queue.Add("b", FetchOf(7));
  std::vector<std::string> taken;
  while (const auto next = queue.TakeNext()) {
    taken.push_back(next->replica + std::to_string(next->fetch.fetch()));
  }
  EXPECT_EQ(taken, (std::vector<std::string>{"a1", "b7", "a2", "a3"}));
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.dropped(), 0u);
}

TEST(FetchQueue, DropsTheOldestOfAReplicaThatHasTooMany) {
  FetchQueue queue;
  for (std::uint64_t k = 1; k <= 1000; ++k) queue.Add("a", FetchOf(k));
  EXPECT_EQ(queue.TakeNext()->fetch.fetch(), 1001 - FetchQueue::kFetchesOfReplica);
  EXPECT_EQ(queue.dropped(), 1000 - FetchQueue::kFetchesOfReplica);
}

TEST(FetchQueue, IsBoundedInReplicasAndBytes) {
  FetchQueue queue;
  queue.Add("a", FetchOf(1, std::string(FetchQueue::kFetchBytes, 'x')));
  queue.Add(std::string(FetchQueue::kFetchBytes, 'a'), FetchOf(1));
  EXPECT_TRUE(queue.empty());
  for (std::size_t k = 0; k < 2 * FetchQueue::kReplicas; ++k) {
    queue.Add(std::to_string(k), FetchOf(k));
  }
  EXPECT_EQ(queue.dropped(), 2 + FetchQueue::kReplicas);
  queue.Add("0", FetchOf(1));  // A known replica.
  std::size_t count = 0;
  while (queue.TakeNext()) ++count;
  EXPECT_EQ(count, FetchQueue::kReplicas + 1);
}

}  // namespace
}  // namespace partiemc::server

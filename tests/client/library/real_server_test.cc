// The library against the real server, over a real port.
#include <gtest/gtest.h>

#include <thread>
#include <utility>
#include <vector>

#include "partiemc/client/local_stream.h"
#include "partiemc/client/server_info.h"
#include "partiemc/client/stream.h"
#include "server/server.h"

namespace partiemc::client {
namespace {

using Digests = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

constexpr int kFrames = 20;
constexpr int kSide = 20;

// A block with a hole, sheared a little more in every frame.
std::vector<float> Block(int frame) {
  std::vector<float> positions;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      if (std::abs(row - 10) < 4 && std::abs(column - 10) < 4) continue;
      positions.push_back(static_cast<float>(column + 0.05 * frame * row));
      positions.push_back(static_cast<float>(row));
    }
  }
  return positions;
}

Digests Replay(FrameStream& stream) {
  std::thread sender([&stream] {
    for (int k = 0; k < kFrames; ++k) {
      const auto positions = Block(k);
      ASSERT_TRUE(stream.Send({.positions = std::span<const float>(positions)}, k).ok());
    }
    ASSERT_TRUE(stream.FinishSending().ok());
  });
  Digests digests;
  Event event;
  for (auto got = stream.Receive(event); got.ok() && *got == Received::kEvent;
       got = stream.Receive(event)) {
    digests.emplace_back(event.frame.rings_digest, event.frame.mesh_digest);
    EXPECT_EQ(DigestRings(event.frame.result.rings), event.frame.rings_digest);
    EXPECT_EQ(DigestMesh(event.frame.result.mesh), event.frame.mesh_digest);
  }
  sender.join();
  return digests;
}

TEST(RealServer, GivesTheSameBitsAsTheCoreInThisProcess) {
  const auto server = server::Server::Start({.address = {.host = "127.0.0.1", .port = 0}});
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string address = "127.0.0.1:" + std::to_string((*server)->address().port);
  const auto remote = Stream::Open(address, {.parameters = {.spacing = 1}});
  ASSERT_TRUE(remote.ok()) << remote.status();
  const auto local = LocalStream::Open({.parameters = {.spacing = 1}, .threads = 2});
  ASSERT_TRUE(local.ok()) << local.status();
  const Digests remote_digests = Replay(**remote);
  EXPECT_EQ(remote_digests.size(), kFrames);
  EXPECT_EQ(remote_digests, Replay(**local));
}

TEST(RealServer, TellsItsVersionAndLimits) {
  const auto server = server::Server::Start({.address = {.host = "127.0.0.1", .port = 0}});
  ASSERT_TRUE(server.ok()) << server.status();
  const auto info = GetServerInfo("127.0.0.1:" + std::to_string((*server)->address().port));
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_FALSE(info->version.empty());
  EXPECT_GT(info->limits.max_particles_per_frame, 0);
  EXPECT_GE(info->placements.size(), 3);
}

}  // namespace
}  // namespace partiemc::client

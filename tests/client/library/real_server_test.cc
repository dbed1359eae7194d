// The library against the real server over a port.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
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

// A body and a drop that leaps over it, with ids and velocities.
struct Leap {
  std::vector<float> positions, velocities;
  std::vector<std::uint64_t> ids;

  explicit Leap(int frame) {
    for (int k = 0; k < 200; ++k) Add(k % 20, k / 20, k, 0, 0);
    for (int k = 0; k < 16; ++k) Add(40 * frame + k % 4, 20 + k / 4, 1000 + k, 80, 0);
  }
  void Add(int x, int y, int id, float vx, float vy) {
    positions.insert(positions.end(), {static_cast<float>(x), static_cast<float>(y)});
    velocities.insert(velocities.end(), {vx, vy});
    ids.push_back(static_cast<std::uint64_t>(id));
  }
};

// The rings of all frames. Frame 3 is refused.
std::vector<Rings> LeapThrough(FrameStream& stream, bool with_ids, bool with_velocities) {
  std::vector<Rings> rings;
  Event event;
  for (int k = 0; k < 6; ++k) {
    Leap leap(k);
    if (k == 2) leap.ids[1] = leap.ids[0];
    if (k == 2) leap.velocities[1] = std::numeric_limits<float>::quiet_NaN();
    Frame frame{.positions = std::span<const float>(leap.positions), .time = 1e9};
    if (with_ids) frame.ids = leap.ids;
    if (with_velocities) frame.velocities = leap.velocities;
    EXPECT_TRUE(stream.Send(frame, 0.5 * k).ok());
    EXPECT_TRUE(stream.Receive(event).ok());
    if (k == 2 && (with_ids || with_velocities)) {
      EXPECT_EQ(event.kind, Event::Kind::kRefusal);
      EXPECT_EQ(event.message, with_ids ? "ids[1]: 0; must be that of one particle only, but "
                                          "ids[0] is the same; leave ids out where particles have "
                                          "none"
                                        : "velocities[0].y: nan; must be finite");
      continue;
    }
    EXPECT_EQ(event.kind, Event::Kind::kResult) << event.message;
    rings.push_back(event.frame.result.rings);
  }
  return rings;
}

TEST(RealServer, TellsIdentitiesByIdsAndVelocitiesAsTheCoreInThisProcessDoes) {
  const auto server = server::Server::Start({.address = {.host = "127.0.0.1", .port = 0}});
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string address = "127.0.0.1:" + std::to_string((*server)->address().port);
  for (const auto& [with_ids, with_velocities] :
       {std::pair(true, false), {false, true}, {true, true}, {false, false}}) {
    const auto remote =
        Stream::Open(address, {.parameters = {.spacing = 1}, .outputs = {.normals = true}});
    ASSERT_TRUE(remote.ok()) << remote.status();
    const auto local = LocalStream::Open({.parameters = {.spacing = 1}});
    ASSERT_TRUE(local.ok()) << local.status();
    const std::vector<Rings> rings = LeapThrough(**local, with_ids, with_velocities);
    EXPECT_EQ(LeapThrough(**remote, with_ids, with_velocities), rings);
    // Body and drop keep their identities, or the drop has a new one in every frame.
    const bool is_told = with_ids || with_velocities;
    const Rings& last = rings.back();
    ASSERT_EQ(last.measures.size(), 2u);
    EXPECT_EQ(rings.size(), is_told ? 5u : 6u);
    EXPECT_EQ(std::max(last.measures[0].identity, last.measures[1].identity), is_told ? 2u : 7u);
  }
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

// Frames of few bytes that reach many tiles, on a server with a small budget.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <iostream>
#include <string>
#include <vector>

#include "server/moving_blob.h"
#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

static_assert(std::endian::native == std::endian::little, "positions are copied as they are");

constexpr double kBudgetMib = 64;
constexpr double kBesidesMib = 64;  // The program and memory outside of the budget.

// 32,400 particles at corners of tiles, each in four tiles of its own: 518 kB, whose 129,600 tiles
// would take a gigabyte.
v1::ReconstructRequest CornersOfTiles(std::uint64_t sequence) {
  v1::ReconstructRequest request;
  v1::ParticleFrame& frame = *request.mutable_frame();
  frame.set_sequence(sequence);
  frame.set_position_format(v1::POSITION_FORMAT_FLOAT64_2);
  for (int k = 0; k < 180 * 180; ++k) {
    const double position[2] = {64 * kBlobSpacing * (k % 180), 64 * kBlobSpacing * (k / 180)};
    frame.mutable_positions()->append(reinterpret_cast<const char*>(position), sizeof(position));
  }
  return request;
}

TEST(TilesMemory, FramesOfTooManyTilesAreRefusedAndMemoryStaysWithinTheBudget) {
  ServingProcess server({"--memory-budget", "64MB", "--threads", "2"});
  const auto channel = grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials());
  StreamClient hostile(channel), honest(channel);
  ASSERT_TRUE(hostile.SendAndReceive(OpenRequest("hostile")).has_opened());
  ASSERT_TRUE(honest.SendAndReceive(OpenRequest("honest")).has_opened());
  const std::vector<Digests> expected = LocalDigests(7, 6);
  double most = 0;
  for (std::uint64_t k = 1; k <= 6; ++k) {
    const auto refused = hostile.SendAndReceive(CornersOfTiles(k));
    ASSERT_TRUE(refused.has_error()) << refused.ShortDebugString();
    EXPECT_EQ(refused.error().reason(), "OUT_OF_MEMORY");
    EXPECT_EQ(refused.error().field(), "positions");
    EXPECT_EQ(refused.error().sequence(), k);
    most = std::max(most, server.process().ResidentMib());
    const auto answer = honest.SendAndReceive(BlobRequest(k, 7, k - 1));
    ASSERT_TRUE(answer.has_frame()) << answer.ShortDebugString();
    EXPECT_EQ((Digests{answer.frame().rings_digest(), answer.frame().mesh_digest()}),
              expected[k - 1]);
  }
  EXPECT_LE(most, kBudgetMib + kBesidesMib);
  RecordProperty("most_resident_mib", std::to_string(most));
  std::cout << "resident at most: " << most << " MiB\n";
}

}  // namespace
}  // namespace partiemc::server

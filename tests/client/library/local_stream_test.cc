// LocalStream: the core in this process behind the interface of a stream.
#include "partiemc/client/local_stream.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "partiemc/partiemc.h"

namespace partiemc::client {
namespace {

// A square lattice that drifts to the right.
std::vector<double> Lattice(int side, double shift) {
  std::vector<double> positions;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      positions.push_back(column + shift);
      positions.push_back(row);
    }
  }
  return positions;
}

const ReconstructionParameters kParameters{.spacing = 1.0};

TEST(LocalStream, AnswersAreThoseOfTheReconstructorFrameByFrame) {
  const auto stream = LocalStream::Open({.parameters = kParameters, .threads = 2});
  ASSERT_TRUE(stream.ok()) << stream.status();
  constexpr int kFrames = 10;
  std::thread sender([&] {
    for (int k = 0; k < kFrames; ++k) {
      const auto positions = Lattice(12, 0.3 * k);
      ASSERT_TRUE((*stream)->Send({.positions = std::span<const double>(positions)}, k).ok());
    }
    ASSERT_TRUE((*stream)->FinishSending().ok());
  });
  const auto reconstructor = Reconstructor::Create(kParameters);
  ASSERT_TRUE(reconstructor.ok());
  State state;
  Workspace workspace;
  Event event;
  for (int k = 0; k < kFrames; ++k) {
    const auto received = (*stream)->Receive(event);
    ASSERT_TRUE(received.ok() && *received == Received::kEvent);
    const auto positions = Lattice(12, 0.3 * k);
    Result expected;
    ASSERT_TRUE(reconstructor
                    ->Reconstruct({.positions = std::span<const double>(positions)}, state,
                                  workspace, expected)
                    .ok());
    EXPECT_EQ(event.sequence, k + 1);
    EXPECT_EQ(event.time, k);
    EXPECT_EQ(event.frame.result, expected);
    EXPECT_EQ(event.frame.rings_digest, DigestRings(expected.rings));
    EXPECT_EQ(event.frame.mesh_digest, DigestMesh(expected.mesh));
  }
  EXPECT_EQ(*(*stream)->Receive(event), Received::kEnd);
  sender.join();
}

TEST(LocalStream, ABadFrameIsRefusedAndTheNextOneIsAnswered) {
  const auto stream = LocalStream::Open({.parameters = kParameters, .threads = 1});
  ASSERT_TRUE(stream.ok());
  std::vector<double> bad = Lattice(4, 0);
  bad[5] = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> good = Lattice(4, 0);
  ASSERT_TRUE((*stream)->Send({.positions = std::span<const double>(bad)}, 0).ok());
  ASSERT_TRUE((*stream)->Send({.positions = std::span<const double>(good)}, 1).ok());
  Event event;
  ASSERT_TRUE((*stream)->Receive(event).ok());
  EXPECT_EQ(event.kind, Event::Kind::kRefusal);
  EXPECT_EQ(event.violation.reason, kReasonNotFinite);
  ASSERT_TRUE((*stream)->Receive(event).ok());
  EXPECT_EQ(event.kind, Event::Kind::kResult);
  EXPECT_EQ(event.frame.result.rings.RingCount(), 1);
}

TEST(LocalStream, CancelEndsItWithFramesStillWaiting) {
  const auto stream = LocalStream::Open({.parameters = kParameters, .threads = 1});
  ASSERT_TRUE(stream.ok());
  const std::vector<double> positions = Lattice(30, 0);
  ASSERT_TRUE((*stream)->Send({.positions = std::span<const double>(positions)}, 0).ok());
  ASSERT_TRUE((*stream)->Send({.positions = std::span<const double>(positions)}, 1).ok());
  EXPECT_EQ((*stream)->InFlight(), 2);
  (*stream)->Cancel();
  Event event;
  EXPECT_EQ((*stream)->Receive(event).status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ((*stream)->Send({.positions = std::span<const double>(positions)}, 2).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(LocalStream, SurfacesAreThoseOfTheReconstructor) {
  const ReconstructionParameters parameters{
      .output = Output::kSurface,
      .spacing = 1,
      .sections = {{.slice = SlicePlane{.origin = {0, 0, 1.5}, .normal = {0, 0, 1}}}}};
  std::vector<double> cube;
  for (int k = 0; k < 512; ++k) {
    for (const int at : {k % 8, k / 8 % 8, k / 64}) cube.push_back(at);
  }
  const Frame frame{.positions = std::span<const double>(cube), .components = 3};
  const auto stream = LocalStream::Open({.parameters = parameters, .threads = 2});
  ASSERT_TRUE(stream.ok()) << stream.status();
  const auto reconstructor = Reconstructor::Create(parameters);
  State state;
  Workspace workspace;
  Result expected;
  Event event;
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE((*stream)->Send(frame, k).ok());
    ASSERT_TRUE((*stream)->Receive(event).ok());
    ASSERT_EQ(event.kind, Event::Kind::kResult);
    ASSERT_TRUE(reconstructor->Reconstruct(frame, state, workspace, expected).ok());
    EXPECT_GT(expected.surface.TriangleCount(), 100u);
    EXPECT_EQ(event.frame.result, expected);
    EXPECT_EQ(event.frame.surface_digest, DigestSurface(expected.surface));
    EXPECT_EQ(event.frame.section_digests, DigestSections(expected));
  }
}

TEST(LocalStream, WrongParametersAreRefused) {
  EXPECT_EQ(LocalStream::Open({.parameters = {.cell_size = 100}}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace partiemc::client

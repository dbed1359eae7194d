// The bytes of the state of surfaces: they come back as they were, and hostile ones are refused.
#include "partiemc/surface_state.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/id_hash.h"
#include "core/internal/byte_string.h"
#include "partiemc/state.h"
#include "partiemc/status.h"
#include "space/surface_stream.h"

namespace partiemc {
namespace {

using support::SurfaceStream;
using support::TrackedParticles;

SurfaceState ExampleSurfaceState() {
  SurfaceState state;
  state.cell_size = .5;
  state.history.identities_given = 9;
  state.history.time = .75;
  state.history.shells = {{.identity = 2, .velocity_x = .5, .velocity_y = -3, .velocity_z = 1},
                          {.identity = 5, .is_cavity = true, .outer = 0},
                          {.identity = 9}};
  state.history.runs = {
      {-7, 2, -5, 3, 0}, {-7, 2, 4, 4, 1}, {-7, 3, -9, 12, 0}, {2, -8, -100, 1 << 30, 2}};
  state.history.samples = {
      {3, -5, -7, 1, 0}, {1ull << 40, 1 << 30, 2, -4, 2}, {~0ull, 9, -7, 0, 0}};
  return state;
}

constexpr std::size_t kVersionAt = 4, kCellSizeAt = 8, kTimeAt = 16, kGivenAt = 24, kCountsAt = 32,
                      kShellsAt = 56, kRunsAt = kShellsAt + 3 * 40, kSamplesAt = kRunsAt + 4 * 20;

std::string Body() {
  std::string bytes = Serialize(ExampleSurfaceState());
  bytes.resize(bytes.size() - 8);
  return bytes;
}

std::string Sealed(std::string body) {
  PutNumber(ChecksumOf(body), body);
  return body;
}

template <typename T>
std::string Patched(std::size_t at, T value) {
  std::string bytes = Body();
  std::memcpy(bytes.data() + at, &value, sizeof(value));
  return Sealed(bytes);
}

void ExpectRefused(std::string_view bytes, const std::string& value, const char* what) {
  const auto state = ParseSurfaceState(bytes);
  ASSERT_FALSE(state.ok()) << what;
  EXPECT_EQ(state.status().code(), absl::StatusCode::kInvalidArgument);
  const auto violation = FindViolation(state.status());
  ASSERT_TRUE(violation.has_value()) << what;
  EXPECT_EQ(violation->reason, kReasonCorruptState);
  EXPECT_EQ(violation->field, "state");
  EXPECT_FALSE(violation->rule.empty());
  EXPECT_NE(violation->value.find(value), std::string::npos) << violation->value << ": " << what;
}

TEST(SurfaceState, ComesBackAsItWas) {
  EXPECT_EQ(*ParseSurfaceState(Serialize(SurfaceState{})), SurfaceState{});
  EXPECT_EQ(*ParseSurfaceState(Serialize(ExampleSurfaceState())), ExampleSurfaceState());
  EXPECT_EQ(*ParseSurfaceState(Sealed(Body())), ExampleSurfaceState());
  EXPECT_EQ(Serialize(SurfaceState{}).size(), 64u);
  EXPECT_EQ(Serialize(ExampleSurfaceState()).size(), 64u + 3 * 40 + 4 * 20 + 3 * 24);
  EXPECT_EQ(SerializedBytes(ExampleSurfaceState()), Serialize(ExampleSurfaceState()).size());
}

TEST(SurfaceState, EveryTruncationAndFlippedBitIsRefused) {
  const std::string bytes = Serialize(ExampleSurfaceState());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ExpectRefused(std::string_view(bytes).substr(0, size), "", "cut short");
    std::string flipped = bytes;
    flipped[size] = static_cast<char>(flipped[size] ^ (1 << size % 8));
    ExpectRefused(flipped, "", "a flipped bit");
  }
  ExpectRefused(bytes + '\0', "", "one byte too many");
  ExpectRefused(Serialize(State{}), "another kind of data", "the state of outlines");
}

TEST(SurfaceState, HostileCountsAreRefusedBeforeAnythingIsAllocated) {
  for (std::size_t kind = 0; kind < 3; ++kind) {
    for (const std::uint64_t count :
         {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{99}, std::uint64_t{1} << 32,
          (std::uint64_t{1} << 61) + 3, std::numeric_limits<std::uint64_t>::max()}) {
      ExpectRefused(Patched(kCountsAt + 8 * kind, count), "bytes for", "a wrong count");
    }
  }
}

TEST(SurfaceState, ContentsThatBreakARuleAreRefused) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ExpectRefused(Patched(kVersionAt, 77u), "version 77", "another version");
  for (const double length : {0.0, -1.0, 1e300, kInfinity}) {
    ExpectRefused(Patched(kCellSizeAt, length), "cell size", "no length");
  }
  ExpectRefused(Patched(kTimeAt, kInfinity), "time", "not finite");
  ExpectRefused(Patched(kGivenAt, std::uint64_t{8}), "identity 9", "an identity not given");
  ExpectRefused(Patched(kGivenAt, std::uint64_t{1} << 63), "identities", "too many identities");
  ExpectRefused(Patched(kShellsAt, std::uint64_t{0}), "identity 0", "no identity");
  ExpectRefused(Patched(kShellsAt + 40, std::uint64_t{2}), "identity 2", "an identity twice");
  ExpectRefused(Patched(kShellsAt + 48, 2u), "another kind", "neither body nor cavity");
  ExpectRefused(Patched(kShellsAt + 52, 1u), "shell 1 in shell 1", "a cavity in itself");
  ExpectRefused(Patched(kShellsAt + 52, 3u), "shell 1 in shell 3", "a shell that is none");
  ExpectRefused(Patched(kShellsAt + 12, 2u), "shell 0 in shell 2", "a body in a body");
  ExpectRefused(Patched(kShellsAt + 32, kInfinity), "velocity of shell 0", "not finite");
  ExpectRefused(Patched(kRunsAt + 16, 3u), "run 0", "no shell");
  ExpectRefused(Patched(kRunsAt + 12, -6), "run 0", "no node");
  ExpectRefused(Patched(kRunsAt + 12, 4), "run 1", "a node of the next run");
  ExpectRefused(Patched(kRunsAt + 24, 1), "run 1", "rows out of order");
  ExpectRefused(Patched(kRunsAt + 60, -8), "run 3", "layers out of order");
  ExpectRefused(Patched(kSamplesAt, ~std::uint64_t{0}), "sample 1", "hashes out of order");
  ExpectRefused(Patched(kSamplesAt + 20, 1u), "sample 0", "a sample of a cavity");
  ExpectRefused(Patched(kSamplesAt + 20, 3u), "sample 0", "a sample of no shell");
  SurfaceState many = ExampleSurfaceState();
  many.history.samples.clear();
  for (std::uint64_t k = 0; k <= kMaxSamples; ++k) many.history.samples.push_back({k, 0, 0, 0, 0});
  ExpectRefused(Serialize(many), "sample 16", "too many samples");
}

// A block that moves, turns into two and has a lone particle beside it.
TrackedParticles MovingBlocks(int frame, bool has_ids) {
  support::Random random(1);
  TrackedParticles all{.known = {.ids = has_ids, .velocities = frame % 2 == 0},
                       .time = static_cast<double>(frame)};
  const double x = 1.3 * frame;
  all.Add(support::Box({0, 0, 0}, {5, 4, 4}, .1, random), 0, {1.3, 0, 0}, {x, 0, 0});
  all.Add(support::Box({6, 0, 0}, {9, 4, 4}, .1, random), 500, {1.3, 0, 0},
          {x + (frame > 2 ? 5.0 : 0), 0, 0});
  all.Add(support::Ball({0, 12, 0}, 0, 0, random), 900, {}, {0, .2 * frame, 0});
  return all;
}

class RestoredSurfaceState : public ::testing::TestWithParam<SurfacePlacement> {};
INSTANTIATE_TEST_SUITE_P(Placements, RestoredSurfaceState,
                         ::testing::Values(SurfacePlacement::kMarchingCubes, SurfacePlacement::kQef,
                                           SurfacePlacement::kVirtualPlane));

TEST_P(RestoredSurfaceState, GivesTheBitsOfAnUnbrokenStream) {
  constexpr int kFrames = 5;
  for (const bool has_ids : {false, true}) {
    SurfaceStream unbroken({.placement = GetParam()});
    std::vector<std::string> states;
    std::vector<Surface> surfaces;
    for (int frame = 0; frame < kFrames; ++frame) {
      states.push_back(Serialize(unbroken.state()));
      surfaces.push_back(unbroken.Next(MovingBlocks(frame, has_ids)));
    }
    for (int restart = 0; restart < kFrames; ++restart) {
      SurfaceStream stream({.placement = GetParam()});
      auto state = ParseSurfaceState(states[static_cast<std::size_t>(restart)]);
      ASSERT_TRUE(state.ok()) << state.status();
      stream.state() = *std::move(state);
      for (int frame = restart; frame < kFrames; ++frame) {
        EXPECT_EQ(stream.Next(MovingBlocks(frame, has_ids)),
                  surfaces[static_cast<std::size_t>(frame)]);
      }
      EXPECT_EQ(stream.state(), unbroken.state());
    }
  }
}

TEST(SurfaceState, OfAnotherCellSizeIsRefused) {
  SurfaceStream stream;
  stream.state() = ExampleSurfaceState();
  TrackedParticles particles = MovingBlocks(0, true);
  const absl::Status status = stream.Try(particles.AsFrame());
  const auto violation = FindViolation(status);
  ASSERT_TRUE(violation.has_value()) << status;
  EXPECT_EQ(violation->reason, kReasonCorruptState);
  EXPECT_EQ(violation->field, "state.cell_size");
  EXPECT_EQ(violation->value, "0.5");
  EXPECT_EQ(stream.state(), ExampleSurfaceState());
}

TEST(SurfaceState, AnyAcceptedStateIsSafeToGoOnFrom) {
  constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min(),
                         kHigh = std::numeric_limits<std::int32_t>::max();
  SurfaceState state = ExampleSurfaceState();
  state.cell_size = 1;
  state.history.time = -1e300;
  state.history.shells[0].velocity_z = 1e300;
  state.history.runs = {
      {kLow, kLow, kLow, kHigh, 0}, {0, 0, kLow, kHigh, 2}, {kHigh, kHigh, 0, 1, 1}};
  TrackedParticles particles = MovingBlocks(0, true);
  state.history.samples[0] = {HashOf(particles.ids[0]), kLow, kHigh, kLow, 0};
  std::sort(state.history.samples.begin(), state.history.samples.end(),
            [](const ShellSample& a, const ShellSample& b) { return a.hash < b.hash; });
  for (const double time : {-1e300, 0.0, 1e300}) {
    SurfaceStream stream;
    auto parsed = ParseSurfaceState(Serialize(state));
    ASSERT_TRUE(parsed.ok()) << parsed.status();
    stream.state() = *std::move(parsed);
    particles.time = time;
    EXPECT_TRUE(stream.Try(particles.AsFrame()).ok());
    EXPECT_TRUE(ParseSurfaceState(Serialize(stream.state())).ok());
  }
}

}  // namespace
}  // namespace partiemc

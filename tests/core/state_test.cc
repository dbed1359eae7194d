#include "partiemc/state.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>
#include <utility>

#include "partiemc/status.h"
#include "support/reconstruct.h"

namespace partiemc {
namespace {

State ExampleState() {
  State state;
  state.cell_size = 0.1;
  state.spacing = 0.09;
  state.normals = {
      {-5, -7, 0.6f, 0.8f}, {3, -7, 1, 0}, {-100, 2, 0, -1}, {1 << 30, 2, -0.8f, 0.6f}};
  state.area_offset = -0.03;
  state.history.identities_given = 9;
  state.history.time = 0.75;
  state.history.rings = {{.identity = 2, .velocity_x = 0.5, .velocity_y = -3},
                         {.identity = 5, .is_hole = true, .outer = 0},
                         {.identity = 9}};
  state.history.runs = {{-7, -5, 3, 0}, {-7, 4, 4, 1}, {-7, 9, 12, 0}, {2, -100, 1 << 30, 2}};
  state.history.samples = {{3, -5, -7, 0}, {1ull << 40, 1 << 30, 2, 2}, {~0ull, 9, -7, 0}};
  return state;
}

// Appends the checksum of the format (FNV-1a), so that a test gets past it.
std::string Sealed(std::string body) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char byte : body) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  for (int k = 0; k < 8; ++k) body.push_back(static_cast<char>(hash >> (8 * k) & 0xff));
  return body;
}

std::string BodyOf(const State& state) {
  std::string bytes = Serialize(state);
  bytes.resize(bytes.size() - 8);
  return bytes;
}

template <typename T>
std::string Patched(std::string bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(value));
  return bytes;
}

constexpr std::size_t kVersionAt = 4, kCellSizeAt = 8, kSpacingAt = 16, kOffsetAt = 24,
                      kTimeAt = 32, kGivenAt = 40, kNormalCountAt = 48, kRingCountAt = 56,
                      kRunCountAt = 64, kSampleCountAt = 72, kNormalsAt = 80,
                      kRingsAt = kNormalsAt + 4 * 16, kRunsAt = kRingsAt + 3 * 32,
                      kSamplesAt = kRunsAt + 4 * 16;

void ExpectRefused(std::string_view bytes, std::string_view what) {
  const auto state = ParseState(bytes);
  ASSERT_FALSE(state.ok()) << what;
  EXPECT_EQ(state.status().code(), absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(FindViolation(state.status()).has_value());
  EXPECT_EQ(FindViolation(state.status())->reason, kReasonCorruptState);
}

TEST(State, ComesBackAsItWas) {
  EXPECT_EQ(*ParseState(Serialize(State{})), State{});
  EXPECT_EQ(*ParseState(Serialize(ExampleState())), ExampleState());
}

TEST(State, TakesAsManyBytesAsItsHeaderSays) {
  EXPECT_EQ(Serialize(State{}).size(), 88u);
  EXPECT_EQ(Serialize(ExampleState()).size(), 88u + 4 * 16 + 3 * 32 + 4 * 16 + 3 * 20);
}

TEST(State, EveryTruncationIsRefused) {
  const std::string bytes = Serialize(ExampleState());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ExpectRefused(std::string_view(bytes).substr(0, size), "cut short");
  }
  ExpectRefused(bytes + '\0', "one byte too many");
}

TEST(State, EveryFlippedBitIsRefused) {
  const std::string bytes = Serialize(ExampleState());
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string flipped = bytes;
      flipped[at] = static_cast<char>(flipped[at] ^ (1 << bit));
      ExpectRefused(flipped, "a flipped bit");
    }
  }
}

TEST(State, ABodySealedByTheTestIsAccepted) {
  EXPECT_EQ(*ParseState(Sealed(BodyOf(ExampleState()))), ExampleState());
}

TEST(State, HostileCountsAreRefusedBeforeAnythingIsAllocated) {
  const std::string body = BodyOf(ExampleState());
  for (const auto& [at, right] : {std::pair(kNormalCountAt, 4u), std::pair(kRingCountAt, 3u),
                                  std::pair(kRunCountAt, 4u), std::pair(kSampleCountAt, 3u)}) {
    EXPECT_EQ(*ParseState(Sealed(Patched(body, at, std::uint64_t{right}))), ExampleState());
    for (const std::uint64_t count :
         {std::uint64_t{0}, std::uint64_t{right - 1}, std::uint64_t{right + 1},
          std::uint64_t{1} << 32, std::uint64_t{1} << 60, (std::uint64_t{1} << 60) + right,
          std::numeric_limits<std::uint64_t>::max()}) {
      ExpectRefused(Sealed(Patched(body, at, count)), "a wrong count");
    }
  }
  // Counts of which the bytes in all are right, were it not for the overflow.
  const std::string overflowing = Patched(body, kNormalCountAt, (std::uint64_t{1} << 60) + 4);
  ExpectRefused(Sealed(Patched(overflowing, kRunCountAt, (std::uint64_t{15} << 60) + 4)),
                "counts that overflow");
  ExpectRefused(Sealed(body.substr(0, body.size() - 1)), "a sample cut short");
}

TEST(State, OtherVersionsAreRefusedByNumber) {
  for (const auto& [version, told] : {std::pair(4u, "version 4;"), std::pair(77u, "version 77;")}) {
    const auto state = ParseState(Sealed(Patched(BodyOf(ExampleState()), kVersionAt, version)));
    ASSERT_FALSE(state.ok());
    EXPECT_NE(state.status().message().find(told), absl::string_view::npos) << state.status();
  }
}

TEST(State, LengthsThatAreNoneAreRefused) {
  const std::string body = BodyOf(ExampleState());
  for (const double value : {-1.0, 1e-80, 1e80, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    ExpectRefused(Sealed(Patched(body, kCellSizeAt, value)), "cell size");
    ExpectRefused(Sealed(Patched(body, kSpacingAt, value)), "spacing");
  }
  ExpectRefused(Sealed(Patched(body, kSpacingAt, 0.0)), "a cell size without a spacing");
  ExpectRefused(Sealed(Patched(body, kCellSizeAt, 0.0)), "a spacing without a cell size");
}

TEST(State, NormalsThatAreNotUnitOrNotInOrderAreRefused) {
  const std::string body = BodyOf(ExampleState());
  for (const float value : {5.0f, 0.0f, std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity()}) {
    ExpectRefused(Sealed(Patched(body, kNormalsAt + 8, value)), "not of unit length");
  }
  // Normal 1 into the cell of normal 0, and behind normal 2.
  ExpectRefused(Sealed(Patched(body, kNormalsAt + 16, std::int32_t{-5})), "twice the same cell");
  ExpectRefused(Sealed(Patched(body, kNormalsAt + 20, std::int32_t{9})), "out of order");
}

TEST(State, AnAreaOffsetBeyondASpacingIsRefused) {
  const std::string body = BodyOf(ExampleState());
  for (const double value : {-1.01, 1.01, std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::quiet_NaN()}) {
    ExpectRefused(Sealed(Patched(body, kOffsetAt, value)), "area offset");
  }
}

TEST(State, RingsWithoutOrderKindOrAnIdentityThatWasGivenAreRefused) {
  const std::string body = BodyOf(ExampleState());
  ExpectRefused(Sealed(Patched(body, kRingsAt, std::uint64_t{0})), "no identity");
  ExpectRefused(Sealed(Patched(body, kRingsAt + 32, std::uint64_t{2})), "twice the same");
  ExpectRefused(Sealed(Patched(body, kRingsAt + 32, std::uint64_t{9})), "out of order");
  ExpectRefused(Sealed(Patched(body, kGivenAt, std::uint64_t{8})), "one that was not given yet");
  ExpectRefused(Sealed(Patched(body, kGivenAt, ~std::uint64_t{0})), "none left to give");
  ExpectRefused(Sealed(Patched(body, kRingsAt + 8, 2u)), "of another kind");
}

TEST(State, RingsInWhatIsNoOuterRingOrWithoutAFiniteMotionAreRefused) {
  const std::string body = BodyOf(ExampleState());
  ExpectRefused(Sealed(Patched(body, kRingsAt + 32 + 12, 1u)), "a hole in itself");
  ExpectRefused(Sealed(Patched(body, kRingsAt + 32 + 12, 3u)), "a hole in no ring");
  ExpectRefused(Sealed(Patched(body, kRingsAt + 12, 2u)), "an outer ring in another one");
  for (const double value :
       {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::quiet_NaN()}) {
    ExpectRefused(Sealed(Patched(body, kRingsAt + 16, value)), "velocity");
    ExpectRefused(Sealed(Patched(body, kRingsAt + 24, value)), "velocity");
    ExpectRefused(Sealed(Patched(body, kTimeAt, value)), "time");
  }
}

TEST(State, SamplesWithoutOrderOrAnOuterRingOrTooManyAreRefused) {
  const std::string body = BodyOf(ExampleState());
  ExpectRefused(Sealed(Patched(body, kSamplesAt + 16, 3u)), "a ring that is not there");
  ExpectRefused(Sealed(Patched(body, kSamplesAt + 16, 1u)), "of a hole");
  ExpectRefused(Sealed(Patched(body, kSamplesAt, std::uint64_t{1} << 40)), "twice the same");
  ExpectRefused(Sealed(Patched(body, kSamplesAt + 20, std::uint64_t{2})), "out of order");
  State state = ExampleState();
  state.history.samples.clear();
  for (std::uint64_t k = 0; k < kMaxSamples; ++k) state.history.samples.push_back({k, 0, 0, 2});
  EXPECT_EQ(*ParseState(Serialize(state)), state);
  state.history.samples.push_back({kMaxSamples, 0, 0, 2});
  ExpectRefused(Serialize(state), "one too many");
}

TEST(State, RunsWithoutOrderNodesOrARingAreRefused) {
  const std::string body = BodyOf(ExampleState());
  ExpectRefused(Sealed(Patched(body, kRunsAt + 12, 3u)), "a ring that is not there");
  ExpectRefused(Sealed(Patched(body, kRunsAt + 8, std::int32_t{-6})), "no nodes");
  ExpectRefused(Sealed(Patched(body, kRunsAt + 8, std::int32_t{4})), "nodes of the next run");
  ExpectRefused(Sealed(Patched(body, kRunsAt + 16, std::int32_t{-8})), "rows out of order");
  ExpectRefused(Sealed(Patched(body, kRunsAt + 48, std::int32_t{-7})), "columns out of order");
}

// A placement, and whether particles have ids.
class RestoredState : public testing::TestWithParam<std::tuple<Placement, bool>> {};

TEST_P(RestoredState, BetweenAnyTwoFramesGivesTheDigestsOfAnUnbrokenStream) {
  constexpr int kFrames = 8;
  const auto [placement, has_ids] = GetParam();
  const auto reconstructor =
      Reconstructor::Create({.placement = placement, .spacing_rule = SpacingRule::kFirstFrame});
  ASSERT_TRUE(reconstructor.ok());
  const auto body_of = [has_ids = has_ids](int frame) {
    support::Particles body = support::MovingBody(frame);
    for (std::size_t k = 0; has_ids && k < body.size(); ++k) body.ids.push_back(k);
    return body;
  };
  std::vector<Result> results;
  std::vector<std::string> states;
  State unbroken;
  Workspace workspace;
  for (int k = 0; k < kFrames; ++k) {
    states.push_back(Serialize(unbroken));
    Result& result = results.emplace_back();
    const support::Particles body = body_of(k);
    ASSERT_TRUE(reconstructor->Reconstruct(body.AsFrame(), unbroken, workspace, result).ok());
  }
  for (int restart = 0; restart < kFrames; ++restart) {
    auto state = ParseState(states[static_cast<std::size_t>(restart)]);
    ASSERT_TRUE(state.ok()) << state.status();
    Workspace fresh;
    Result result;
    for (int k = restart; k < kFrames; ++k) {
      const support::Particles body = body_of(k);
      ASSERT_TRUE(reconstructor->Reconstruct(body.AsFrame(), *state, fresh, result).ok());
      const Result& expected = results[static_cast<std::size_t>(k)];
      EXPECT_EQ(DigestRings(result.rings), DigestRings(expected.rings));
      EXPECT_EQ(DigestMesh(result.mesh), DigestMesh(expected.mesh));
    }
    EXPECT_EQ(*state, unbroken);
  }
}

INSTANTIATE_TEST_SUITE_P(Placements, RestoredState,
                         testing::Combine(testing::ValuesIn(AllPlacements()), testing::Bool()));

TEST(State, AnyAcceptedStateIsSafeToGoOnFrom) {
  // Lengths that do not fit each other nor the frame: no crash, and a result or a clear refusal.
  for (const double cell_size : {1e-60, 1e-3, 1.0, 1e3, 1e60}) {
    for (const double spacing : {1e-60, 1.0, 1e60}) {
      State state = ExampleState();
      state.cell_size = cell_size;
      state.spacing = spacing;
      const auto reconstructor = Reconstructor::Create({}, {.max_tiles = 2000});
      Workspace workspace;
      Result result;
      support::Particles body = support::MovingBody(0);
      for (std::size_t k = 0; k < body.size(); ++k) body.ids.push_back(k);
      body.time = 1e300;
      const absl::Status status =
          reconstructor->Reconstruct(body.AsFrame(), state, workspace, result);
      EXPECT_TRUE(status.ok() || FindViolation(status).has_value()) << status;
    }
  }
}

}  // namespace
}  // namespace partiemc

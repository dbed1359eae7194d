// A session accepts frames in order, and a refused frame leaves no trace in it.
#include "server/stream/session.h"

#include <absl/base/config.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <oneapi/tbb/global_control.h>

#include <atomic>
#include <limits>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/moving_blob.h"
#include "support/reason_of.h"

namespace partiemc::server {
namespace {

using support::ReasonOf;

constexpr unsigned kSeed = 20;

// A session starts no thread. stream_state_machine_test.cc tests the threads of the pool.
const oneapi::tbb::global_control one_thread(oneapi::tbb::global_control::max_allowed_parallelism,
                                             1);
constexpr FrameLimits kLimits{.max_particles = 2000, .max_tiles = 1000};

using Digests = std::pair<std::uint64_t, std::uint64_t>;

Frame FrameOf(const std::vector<double>& positions) {
  Frame frame;
  frame.positions = std::span<const double>(positions);
  return frame;
}

// A session, its worker and its last result.
class Stream {
 public:
  Stream() : session_(*Session::Open(BlobParameters(), kLimits)) {}

  absl::Status Answer(std::uint64_t sequence, const absl::StatusOr<Frame>& frame) {
    return session_.Answer(sequence, frame, worker_, [this](const Result& result, auto&) {
      last_ = {DigestRings(result.rings), DigestMesh(result.mesh)};
      last_ring_count_ = result.rings.RingCount();
      return absl::OkStatus();
    });
  }
  absl::Status Answer(std::uint64_t sequence, const std::vector<double>& positions) {
    return Answer(sequence, FrameOf(positions));
  }
  // Reconstructs frame `index` of the sequence under the next number.
  Digests Good(std::uint64_t index) {
    const auto status = Answer(session_.next_sequence(), MovingBlob(kSeed, index));
    EXPECT_TRUE(status.ok()) << status;
    return last_;
  }

  Session& session() { return session_; }
  Worker& worker() { return worker_; }
  std::size_t last_ring_count() const { return last_ring_count_; }

 private:
  Session session_;
  Worker worker_;
  Digests last_;
  std::size_t last_ring_count_ = 0;
};

TEST(Session, StartsWithOneAndGivesAResultWithRings) {
  Stream stream;
  EXPECT_EQ(stream.session().next_sequence(), 1u);
  stream.Good(0);
  EXPECT_EQ(stream.session().next_sequence(), 2u);
  EXPECT_GE(stream.last_ring_count(), 2u) << "the blob has an outer ring and a hole";
}

TEST(Session, RefusesParametersThatTheCoreRefuses) {
  ReconstructionParameters parameters;
  parameters.kernel_radius = 100;
  const auto session = Session::Open(parameters, kLimits);
  EXPECT_EQ(session.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(FindViolation(session.status())->field, "parameters.kernel_radius");
}

TEST(Session, ARefusedFrameDoesNotChangeTheNextResult) {
  Stream undisturbed, spoiled;
  std::vector<double> nan = MovingBlob(kSeed, 1);
  nan[7] = std::numeric_limits<double>::quiet_NaN();
  std::set<Digests> different;
  for (std::uint64_t i = 0; i < 4; ++i) {
    const auto status = spoiled.Answer(spoiled.session().next_sequence(), nan);
    EXPECT_EQ(ReasonOf(status), kReasonNotFinite);
    const Digests digests = spoiled.Good(i);
    EXPECT_EQ(digests, undisturbed.Good(i)) << "frame " << i;
    different.insert(digests);
  }
  EXPECT_EQ(different.size(), 4u) << "frames that are all alike prove nothing";
  EXPECT_EQ(spoiled.session().next_sequence(), 9u);
}

TEST(Session, AnEmptyFrameIsNoErrorAndChangesNothingThatComesAfterTheFirst) {
  Stream stream;
  EXPECT_TRUE(stream.Answer(1, std::vector<double>{}).ok());
  EXPECT_EQ(stream.last_ring_count(), 0u);
  Stream other;
  EXPECT_EQ(stream.Good(0), other.Good(0));
}

TEST(Session, AGapOrADuplicateUsesUpNothing) {
  Stream stream, undisturbed;
  stream.Good(0);
  undisturbed.Good(0);
  EXPECT_EQ(ReasonOf(stream.Answer(3, MovingBlob(kSeed, 5))), kReasonSequenceGap);
  EXPECT_EQ(ReasonOf(stream.Answer(1, MovingBlob(kSeed, 0))), kReasonSequenceDuplicate);
  EXPECT_EQ(ReasonOf(stream.Answer(0, MovingBlob(kSeed, 0))), kReasonSequenceDuplicate);
  EXPECT_EQ(
      ReasonOf(stream.Answer(std::numeric_limits<std::uint64_t>::max(), MovingBlob(kSeed, 0))),
      kReasonSequenceGap);
  EXPECT_EQ(stream.session().next_sequence(), 2u);
  EXPECT_EQ(stream.Good(1), undisturbed.Good(1));
}

TEST(Session, AGapTellsTheNumberThatIsExpected) {
  Stream stream;
  const auto status = stream.Answer(7, MovingBlob(kSeed, 0));
  EXPECT_EQ(status.message(), "sequence: 7; must be 1; a frame before it is missing");
}

TEST(Session, AFrameThatCannotBeDecodedUsesUpItsNumberButNotOutOfTurn) {
  Stream stream;
  const absl::StatusOr<Frame> undecodable =
      ViolationError(absl::StatusCode::kInvalidArgument, {"BYTE_COUNT", "positions", "7", "8"});
  EXPECT_EQ(ReasonOf(stream.Answer(2, undecodable)), kReasonSequenceGap);
  EXPECT_EQ(stream.session().next_sequence(), 1u);
  EXPECT_EQ(ReasonOf(stream.Answer(1, undecodable)), "BYTE_COUNT");
  EXPECT_EQ(stream.session().next_sequence(), 2u);
}

TEST(Session, TooManyParticlesAreRefusedByTheLimitOfTheServer) {
  Stream stream;
  EXPECT_EQ(ReasonOf(stream.Answer(1, std::vector<double>(2 * 2001, 0.5))),
            kReasonTooManyParticles);
}

TEST(Session, AResultThatCannotBeDeliveredLeavesTheStateAlone) {
  Stream refused, undisturbed;
  refused.Good(0);
  undisturbed.Good(0);
  const std::vector<double> positions = MovingBlob(kSeed, 9);
  const auto status =
      refused.session().Answer(2, FrameOf(positions), refused.worker(), [](auto&, auto&) {
        return ViolationError(absl::StatusCode::kOutOfRange, {"RESOLUTION", "f", "v", "r"});
      });
  EXPECT_EQ(ReasonOf(status), "RESOLUTION");
  EXPECT_EQ(refused.session().next_sequence(), 3u);
  EXPECT_EQ(refused.Good(1), undisturbed.Good(1));
}

TEST(Session, MemoryThatRunsOutIsAnErrorOfTheFrameAndTheStreamGoesOn) {
  Stream stream, undisturbed;
  stream.Good(0);
  undisturbed.Good(0);
  const std::vector<double> positions = MovingBlob(kSeed, 9);
  const auto status =
      stream.session().Answer(2, FrameOf(positions), stream.worker(),
                              [](auto&, auto&) -> absl::Status { throw std::bad_alloc(); });
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(status), kReasonOutOfMemory);
  EXPECT_EQ(stream.Good(1), undisturbed.Good(1));
}

// Particles at corners of tiles, each in four tiles that no other particle uses.
std::vector<double> CornersOfTiles(int side) {
  std::vector<double> positions;
  for (int k = 0; k < side * side; ++k) {
    positions.push_back(64 * kBlobSpacing * (k % side));
    positions.push_back(64 * kBlobSpacing * (k / side));
  }
  return positions;
}

TEST(Session, TilesBeyondTheBudgetRefuseTheFrameOnly) {
  MemoryBudget budget(std::uint64_t{20} << 20);
  Worker worker(nullptr, &budget);
  Session session =
      *Session::Open(BlobParameters(), {.max_particles = 20'000, .max_tiles = 50'000});
  Stream undisturbed;
  Digests digests;
  const auto answer = [&](const std::vector<double>& positions) {
    return session.Answer(session.next_sequence(), FrameOf(positions), worker,
                          [&](const Result& result, auto&) {
                            digests = {DigestRings(result.rings), DigestMesh(result.mesh)};
                            return absl::OkStatus();
                          });
  };
  ASSERT_TRUE(answer(MovingBlob(kSeed, 0)).ok());
  undisturbed.Good(0);
  EXPECT_EQ(budget.held(), 0u) << "an ordinary frame needs nothing of it";
  const absl::Status refused = answer(CornersOfTiles(70));  // About 200 MB.
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(refused), kReasonOutOfMemory);
  EXPECT_EQ(session.next_sequence(), 3u);
  EXPECT_EQ(budget.held(), 0u);
  ASSERT_TRUE(answer(MovingBlob(kSeed, 1)).ok());
  EXPECT_EQ(digests, undisturbed.Good(1));
  ASSERT_TRUE(answer(CornersOfTiles(25)).ok()) << "about 30 MB, for which there is room";
  EXPECT_GT(budget.held(), std::uint64_t{5} << 20);
  worker.Empty();
  EXPECT_EQ(budget.held(), 0u);
}

TEST(Session, ACancelledFrameUsesUpNothingAndMayComeAgain) {
  Stream stream, undisturbed;
  stream.Good(0);
  undisturbed.Good(0);
  const std::vector<double> positions = MovingBlob(kSeed, 1);
  const std::atomic<bool> cancelled = true;
  const absl::Status status = stream.session().Answer(
      2, FrameOf(positions), stream.worker(),
      [](auto&, auto&) {
        ADD_FAILURE() << "was delivered";
        return absl::OkStatus();
      },
      &cancelled);
  EXPECT_TRUE(absl::IsCancelled(status)) << status;
  EXPECT_EQ(FindViolation(status), std::nullopt);
  EXPECT_EQ(stream.session().next_sequence(), 2u);
  EXPECT_EQ(stream.Good(1), undisturbed.Good(1));
  EXPECT_EQ(stream.Good(2), undisturbed.Good(2));
}

TEST(Session, TheWorkerThatComputesMakesNoDifference) {
  Stream one;
  Session two = *Session::Open(BlobParameters(), kLimits);
  Worker workers[2];
  for (std::uint64_t i = 0; i < 6; ++i) {
    const Digests expected = one.Good(i);
    const std::vector<double> positions = MovingBlob(kSeed, i);
    Digests digests;
    // The workers have computed different frames.
    const auto status =
        two.Answer(i + 1, FrameOf(positions), workers[i % 2], [&](const Result& result, auto&) {
          digests = {DigestRings(result.rings), DigestMesh(result.mesh)};
          return absl::OkStatus();
        });
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_EQ(digests, expected);
  }
}

// A sanitizer replaces malloc, and mallinfo2 then returns 0.
#if !defined(ABSL_HAVE_ADDRESS_SANITIZER) && !defined(ABSL_HAVE_THREAD_SANITIZER)

// Bytes that are allocated.
std::size_t HeldBytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

TEST(Session, AStreamHoldsNothingOfALargerOneThatHadTheSameWorker) {
  constexpr std::size_t kSessions = 20, kMaxBytesEach = 100 << 10;
  constexpr FrameLimits kLarge{.max_particles = 5000, .max_tiles = 5000};
  std::vector<double> spray, pair = {0, 0, kBlobSpacing, 0};
  for (int k = 0; k < 4000; ++k) {  // Particles too far apart to share an outline.
    spray.push_back(k % 64 * 10 * kBlobSpacing);
    spray.push_back(k / 64 * 10 * kBlobSpacing);
  }
  const auto ignore = [](auto&, auto&) { return absl::OkStatus(); };
  Worker worker;
  std::vector<Session> small;
  for (std::size_t k = 0; k <= kSessions; ++k) {
    small.push_back(*Session::Open(BlobParameters(), kLarge));
  }
  Session large = *Session::Open(BlobParameters(), kLarge);
  std::size_t before = 0;
  for (std::size_t k = 0; k <= kSessions; ++k) {
    if (k == 1) before = HeldBytes();  // Warm from now on.
    ASSERT_TRUE(large.Answer(k + 1, FrameOf(spray), worker, ignore).ok());
    ASSERT_TRUE(small[k].Answer(1, FrameOf(pair), worker, ignore).ok());
  }
  const std::size_t after = HeldBytes();
  ASSERT_GT(before, 0u) << "mallinfo2 counts nothing";
  ASSERT_GT(large.MakeCheckpoint({}, nullptr, ~0ull).size(), 4 * kMaxBytesEach);
  EXPECT_LE(after, before + kSessions * kMaxBytesEach);
}

#endif  // No sanitizer.

TEST(Session, TheClockOfAResultHasATimeForEveryStageAndForTheWhole) {
  Stream stream;
  const std::vector<double> positions = MovingBlob(kSeed, 0);
  const std::vector<float> pressure(positions.size() / 2);
  const std::vector<Attribute> attributes = {{.name = "pressure", .values = pressure}};
  Frame frame = FrameOf(positions);
  frame.attributes = attributes;
  double stages = -1, total = -1;
  ASSERT_TRUE(stream.session()
                  .Answer(1, frame, stream.worker(),
                          [&](const Result&, const StageClock& clock) {
                            stages = 0;
                            for (const double ms : clock.stages_ms()) {
                              EXPECT_GT(ms, 0);
                              stages += ms;
                            }
                            total = clock.TotalMs();
                            return absl::OkStatus();
                          })
                  .ok());
  EXPECT_GE(total, stages);
}

}  // namespace
}  // namespace partiemc::server

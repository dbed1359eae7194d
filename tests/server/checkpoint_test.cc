// Checkpoints: a session resumed from one gives the bits of an uninterrupted one; malformed bytes
// are refused.
#include "server/stream/checkpoint.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/internal/byte_string.h"
#include "partiemc/status.h"
#include "server/moving_blob.h"
#include "server/stream/session.h"
#include "server/stream/stream_token.h"
#include "support/reason_of.h"

namespace partiemc::server {
namespace {

using support::ReasonOf;

constexpr unsigned kSeed = 31;
constexpr std::uint64_t kFrames = 12;
constexpr FrameLimits kLimits{.max_particles = 2000, .max_tiles = 1000};
const oneapi::tbb::global_control one_thread(oneapi::tbb::global_control::max_allowed_parallelism,
                                             1);

using Digests = std::pair<std::uint64_t, std::uint64_t>;

// Answers the next frame; its particles may have ids.
Digests Answer(Session& session, Worker& worker, bool has_ids = false) {
  const std::uint64_t sequence = session.next_sequence();
  const std::vector<double> positions = MovingBlob(kSeed, sequence);
  std::vector<std::uint64_t> ids(has_ids ? positions.size() / 2 : 0);
  std::iota(ids.begin(), ids.end(), 0);
  Frame frame;
  frame.positions = std::span<const double>(positions);
  frame.ids = ids;
  Digests digests;
  const absl::Status status =
      session.Answer(sequence, frame, worker, [&](const Result& result, auto&) {
        digests = {DigestRings(result.rings), DigestMesh(result.mesh)};
        return absl::OkStatus();
      });
  EXPECT_TRUE(status.ok()) << status;
  return digests;
}

const std::string kToken(32, '7');
constexpr std::uint64_t kAnyBytes = ~std::uint64_t{0};

StreamTerms Terms() {
  return {.lineage = LineageOf(kToken),
          .name = "tank",
          .labels = FingerprintOf({{"run", "7"}}),
          .outputs = 5,
          .checkpoint_interval = 4};
}

std::string CheckpointOf(const Session& session, const CheckpointKeys* keys = nullptr) {
  return session.MakeCheckpoint(Terms(), keys, kAnyBytes);
}

absl::StatusOr<Checkpoint> Parse(std::string_view bytes, const CheckpointKeys* keys = nullptr,
                                 const StreamTerms& terms = Terms()) {
  const auto session = Session::Open(BlobParameters(), kLimits);
  return ParseCheckpoint(bytes, session->parameters(), terms, keys);
}

absl::StatusOr<Session> Resume(const std::string& bytes) {
  auto checkpoint = Parse(bytes);
  if (!checkpoint.ok()) return checkpoint.status();
  auto session = Session::Open(BlobParameters(), kLimits);
  EXPECT_TRUE(session->GoOnFrom(*std::move(checkpoint)).ok());
  return session;
}

std::string CheckpointAfter(std::uint64_t frames, const CheckpointKeys* keys = nullptr) {
  Session session = *Session::Open(BlobParameters(), kLimits);
  Worker worker;
  while (session.next_sequence() <= frames) Answer(session, worker);
  return CheckpointOf(session, keys);
}

TEST(Checkpoint, OfAStateThatDoesNotFitIsRefused) {
  auto checkpoint = Parse(CheckpointAfter(3));
  ASSERT_TRUE(checkpoint.ok()) << checkpoint.status();
  StateMemory memory(100, 0);
  auto session = Session::Open(BlobParameters(), kLimits, {memory, nullptr});
  const absl::Status status = session->GoOnFrom(*std::move(checkpoint));
  EXPECT_EQ(FindViolation(status)->reason, "MEMORY_BUDGET") << status;
  EXPECT_EQ(session->next_sequence(), 1u);
}

class ResumedSession : public testing::TestWithParam<bool> {};

TEST_P(ResumedSession, GoesOnFromAnyFrameBitForBit) {
  Session undisturbed = *Session::Open(BlobParameters(), kLimits);
  Worker worker;
  std::vector<std::string> checkpoints;
  std::vector<Digests> expected;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    checkpoints.push_back(CheckpointOf(undisturbed));
    expected.push_back(Answer(undisturbed, worker, GetParam()));
  }
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    auto resumed = Resume(checkpoints[k]);
    ASSERT_TRUE(resumed.ok()) << resumed.status();
    ASSERT_EQ(resumed->next_sequence(), k + 1);
    Worker other_worker;
    for (std::uint64_t i = k; i < kFrames; ++i) {
      EXPECT_EQ(Answer(*resumed, other_worker, GetParam()), expected[i])
          << "frame " << i << " from " << k;
    }
    EXPECT_EQ(CheckpointOf(*resumed), CheckpointOf(undisturbed));
  }
}

INSTANTIATE_TEST_SUITE_P(Checkpoint, ResumedSession, testing::Bool(), [](const auto& instance) {
  return instance.param ? "WithIds" : "WithoutIds";
});

TEST(Checkpoint, NoBytesAreTheBeginningOfTheStream) {
  const auto session = Resume("");
  ASSERT_TRUE(session.ok());
  EXPECT_EQ(session->next_sequence(), 1u);
}

TEST(Checkpoint, AnyFlippedByteIsRefused) {
  const std::string checkpoint = CheckpointAfter(2);
  for (std::size_t k = 0; k < checkpoint.size(); ++k) {
    std::string flipped = checkpoint;
    flipped[k] = static_cast<char>(flipped[k] ^ (1 << (k % 8)));
    const auto session = Resume(flipped);
    ASSERT_FALSE(session.ok()) << "byte " << k;
    ASSERT_TRUE(FindViolation(session.status())) << session.status();
    // Another version is refused with another code.
    ASSERT_EQ(session.status().code(), k >= 4 && k < 8 ? absl::StatusCode::kFailedPrecondition
                                                       : absl::StatusCode::kInvalidArgument)
        << session.status();
  }
}

TEST(Checkpoint, AnythingCutOffOrAppendedIsRefused) {
  const std::string checkpoint = CheckpointAfter(2);
  for (std::size_t size = 1; size < checkpoint.size(); ++size) {
    const auto session = Resume(checkpoint.substr(0, size));
    ASSERT_FALSE(session.ok()) << size << " bytes";
  }
  EXPECT_FALSE(Resume(checkpoint + '\0').ok());
  EXPECT_EQ(ReasonOf(Resume("x").status()), kReasonCorruptCheckpoint);
}

TEST(Checkpoint, IsBoundToEveryParameter) {
  const std::string checkpoint = CheckpointAfter(1);
  std::vector<ReconstructionParameters> others(25, BlobParameters());
  others[0].spacing = kBlobSpacing * 1.0001;
  others[1].placement = Placement::kQef;
  others[2].fill = Fill::kNone;
  others[3].kernel_radius = 2.5;
  others[4].cell_size = 0.5;
  others[5].reference_radius = 1.25;
  others[6].normal_memory = false;
  others[7].clean = false;
  others[8].min_component_particles = 1;
  others[9].slice = SlicePlane{};
  others[10].isovalue = 0.5;
  others[11].sections = {{.isovalue = 0.5}};
  others[12].box = PeriodicBox{.axes = {PeriodicAxis{0, 1e3}, PeriodicAxis{0, 1e3}}};
  others[13].box = PeriodicBox{.axes = {PeriodicAxis{0, 1e3}}};
  others[14].noise_filter = .5;
  others[15].sizes = Sizes::kOwn;
  others[16].box = PeriodicBox{.axes = {PeriodicAxis{0, 1e3}}, .wraps = true};
  others[17].sections = {{.phase = 1}};
  others[18].sections = {{.phase = 2}};
  others[19].sizes = Sizes::kOwn;
  others[19].boundary = Boundary::kGrains;
  others[20].walls = {{.points = {0, -100, 1, -100}}};
  others[21].walls = {{.points = {0, -100, 1, -100}}, {.points = {1, 100, 0, 100}}};
  others[22].walls = {{.points = {-100, -100, 100, -100, 0, 100}}};
  others[23].wall_phases = {1};
  others[24].wall_phases = {1, 2};
  for (std::size_t k = 0; k < others.size(); ++k) {
    const auto session = Session::Open(others[k], kLimits);
    const auto refused = ParseCheckpoint(checkpoint, session->parameters(), Terms(), nullptr);
    ASSERT_FALSE(refused.ok()) << k;
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(ReasonOf(refused.status()), kReasonCheckpointMismatch);
  }
  ReconstructionParameters default_told = BlobParameters();
  default_told.clean = true;  // The default of `virtual-plane`.
  const auto session = Session::Open(default_told, kLimits);
  EXPECT_TRUE(ParseCheckpoint(checkpoint, session->parameters(), Terms(), nullptr).ok());
}

TEST(Checkpoint, IsBoundToTheWallsOfASurface) {
  std::vector<ReconstructionParameters> all(5, BlobParameters());
  for (ReconstructionParameters& parameters : all) parameters.output = Output::kSurface;
  all[1].wall_planes = {{0, 1, true}};
  all[2].wall_planes = {{1, 1, true}};
  all[3].wall_planes = {{0, 1, false}};
  all[4].wall_planes = {{0, 2, true}};
  for (std::size_t of = 0; of < all.size(); ++of) {
    const std::string checkpoint = Serialize(1, State{}, all[of], Terms(), nullptr);
    for (std::size_t k = 0; k < all.size(); ++k) {
      const auto parsed = ParseCheckpoint(checkpoint, all[k], Terms(), nullptr);
      EXPECT_EQ(ReasonOf(parsed.status()) == kReasonCheckpointMismatch, k != of) << of << " " << k;
    }
  }
}

TEST(Checkpoint, DistinguishesParametersWithTheSameValue) {
  ReconstructionParameters tolerant = BlobParameters(), isoline = BlobParameters();
  tolerant.attribute_tolerance = 0.3;
  isoline.isovalue = 0.3;
  const std::string checkpoint = Serialize(1, State{}, tolerant, Terms(), nullptr);
  EXPECT_EQ(ReasonOf(ParseCheckpoint(checkpoint, isoline, Terms(), nullptr).status()),
            kReasonCheckpointMismatch);
}

TEST(Checkpoint, KeepsItsFingerprintOfParameters) {
  constexpr std::size_t kFingerprintAt = 4 * 4 + 32;
  const std::string bytes = Serialize(1, State{}, {.spacing = 1.0}, Terms(), nullptr);
  std::string_view rest = std::string_view(bytes).substr(kFingerprintAt);
  EXPECT_EQ(TakeNumber<std::uint64_t>(rest), 0x7b5fb422f893357bu)
      << "checkpoints of version 2 would be refused";
}

TEST(Checkpoint, IsBoundToItsStreamAndToAllOfItsTerms) {
  const std::string checkpoint = CheckpointAfter(1);
  const auto value = [&](auto change) {
    StreamTerms terms = Terms();
    change(terms);
    const auto refused = Parse(checkpoint, nullptr, terms);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(ReasonOf(refused.status()), kReasonCheckpointMismatch);
    const auto violation = FindViolation(refused.status());
    return violation ? violation->value : "";
  };
  EXPECT_EQ(value([](StreamTerms& terms) { terms.lineage = LineageOf(std::string(32, '8')); }),
            "another stream");
  EXPECT_EQ(value([](StreamTerms& terms) { terms.name = "tank2"; }), "another stream_name");
  EXPECT_EQ(value([](StreamTerms& terms) { terms.labels = FingerprintOf({}); }), "other labels");
  EXPECT_EQ(value([](StreamTerms& terms) { terms.outputs = 4; }), "other outputs");
  EXPECT_EQ(value([](StreamTerms& terms) { terms.checkpoint_interval = 8; }),
            "another checkpoint_interval");
}

TEST(Checkpoint, TellsLabelsApartWhereverTheirTextsEnd) {
  EXPECT_NE(FingerprintOf({{"a", "bc"}}), FingerprintOf({{"ab", "c"}}));
  EXPECT_NE(FingerprintOf({{"a", "b"}, {"c", "d"}}), FingerprintOf({{"a", "bcd"}}));
  EXPECT_NE(FingerprintOf({{"a", ""}}), FingerprintOf({}));
}

TEST(Checkpoint, KnowsTheNameOfAStreamThatLeavesItOpen) {
  StreamTerms terms = Terms();
  terms.name.clear();
  const auto checkpoint = Parse(CheckpointAfter(1), nullptr, terms);
  ASSERT_TRUE(checkpoint.ok()) << checkpoint.status();
  EXPECT_EQ(checkpoint->name, "tank");
  EXPECT_EQ(Parse("")->name, "tank") << "no bytes are bound to nothing";
}

TEST(Checkpoint, LargerThanAllowedIsNoneAtAll) {
  Session session = *Session::Open(BlobParameters(), kLimits);
  Worker worker;
  Answer(session, worker);
  const CheckpointKeys keys = *CheckpointKeys::Parse("0123456789abcdef");
  StreamTerms terms = Terms();
  terms.name = std::string(128, 'n');
  const std::string whole = session.MakeCheckpoint(terms, &keys, kAnyBytes);
  for (std::uint64_t bytes : {whole.size() / 2, whole.size() - 1}) {
    EXPECT_EQ(session.MakeCheckpoint(terms, &keys, bytes), "") << bytes;
  }
  EXPECT_EQ(session.MakeCheckpoint(terms, &keys, whole.size() + kMaxCheckpointOverhead), whole);
}

class SignedCheckpoint : public testing::Test {
 protected:
  static std::string ReasonFor(std::string_view bytes, const CheckpointKeys& keys) {
    const auto parsed = Parse(bytes, &keys);
    return parsed.ok() ? "accepted" : ReasonOf(parsed.status());
  }

  const CheckpointKeys a_ = *CheckpointKeys::Parse("key-a-0123456789");
  const CheckpointKeys b_ = *CheckpointKeys::Parse("key-b-0123456789");
  const CheckpointKeys both_ = *CheckpointKeys::Parse("key-b-0123456789\nkey-a-0123456789");
  const std::string of_a_ = CheckpointAfter(2, &a_);
};

TEST_F(SignedCheckpoint, IsTakenByWhoHasTheKeyAndByWhoHasNone) {
  EXPECT_EQ(ReasonFor(of_a_, a_), "accepted");
  EXPECT_EQ(ReasonFor(of_a_, both_), "accepted");
  EXPECT_EQ(ReasonFor(CheckpointAfter(2, &both_), b_), "accepted");
  EXPECT_TRUE(Parse(of_a_).ok()) << "a server without keys cannot tell";
  EXPECT_TRUE(Parse(of_a_, &a_)->state == Parse(CheckpointAfter(2))->state);
  EXPECT_EQ(Parse(of_a_, &a_)->next_sequence, 3u);
}

TEST_F(SignedCheckpoint, IsAskedForWhereThereAreKeys) {
  EXPECT_EQ(ReasonFor(CheckpointAfter(2), a_), kReasonCheckpointSignature);
  EXPECT_EQ(ReasonFor(of_a_, b_), kReasonCheckpointSignature);
  EXPECT_EQ(ReasonFor(CheckpointAfter(2, &both_), a_), kReasonCheckpointSignature);
  EXPECT_TRUE(Parse("", &a_).ok()) << "the beginning of a stream needs none";
}

TEST_F(SignedCheckpoint, IsRefusedBeforeAnythingElseForAnyByte) {
  for (std::size_t k = 0; k < of_a_.size(); ++k) {
    std::string flipped = of_a_;
    flipped[k] = static_cast<char>(flipped[k] ^ (1 << (k % 8)));
    ASSERT_EQ(ReasonFor(flipped, a_), kReasonCheckpointSignature) << "byte " << k;
    ASSERT_EQ(ReasonFor(std::string_view(of_a_).substr(0, k), a_),
              k == 0 ? "accepted" : kReasonCheckpointSignature)
        << k << " bytes";
  }
  EXPECT_EQ(ReasonFor(of_a_ + '\0', a_), kReasonCheckpointSignature);
}

}  // namespace
}  // namespace partiemc::server

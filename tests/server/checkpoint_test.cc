// Checkpoints: a session that goes on from one gives the bits of one that never stopped, and bytes
// that are none are refused.
#include "server/checkpoint.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/moving_blob.h"
#include "server/session.h"

namespace partiemc::server {
namespace {

constexpr unsigned kSeed = 31;
constexpr std::uint64_t kFrames = 12;
constexpr FrameLimits kLimits{.max_particles = 2000, .max_tiles = 1000};
const oneapi::tbb::global_control one_thread(oneapi::tbb::global_control::max_allowed_parallelism,
                                             1);

using Digests = std::pair<std::uint64_t, std::uint64_t>;

std::string ReasonOf(const absl::Status& status) {
  const auto violation = FindViolation(status);
  return violation ? violation->reason : status.ToString();
}

// Answers the frame that comes next; its particles have ids or none.
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

absl::StatusOr<Session> Resume(const std::string& checkpoint) {
  return Session::Resume(BlobParameters(), kLimits, checkpoint);
}

std::string CheckpointAfter(std::uint64_t frames) {
  Session session = *Session::Open(BlobParameters(), kLimits);
  Worker worker;
  while (session.next_sequence() <= frames) Answer(session, worker);
  return session.Checkpoint();
}

class ResumedSession : public testing::TestWithParam<bool> {};

TEST_P(ResumedSession, GoesOnFromAnyFrameBitForBit) {
  Session undisturbed = *Session::Open(BlobParameters(), kLimits);
  Worker worker;
  std::vector<std::string> checkpoints;
  std::vector<Digests> expected;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    checkpoints.push_back(undisturbed.Checkpoint());
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
    EXPECT_EQ(resumed->Checkpoint(), undisturbed.Checkpoint());
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
    ASSERT_EQ(session.status().code(), absl::StatusCode::kInvalidArgument) << session.status();
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
  std::vector<ReconstructionParameters> others(10, BlobParameters());
  others[0].spacing = kBlobSpacing * 1.0001;
  others[1].placement = Placement::kQef;
  others[2].fill = Fill::kNone;
  others[3].kernel_radius = 2.5;
  others[4].cell_size = 0.5;
  others[5].reference_radius = 1.25;
  others[6].normal_memory = false;
  others[7].outline_memory = false;
  others[8].clean = false;
  others[9].min_component_particles = 1;
  for (std::size_t k = 0; k < others.size(); ++k) {
    const auto refused = Session::Resume(others[k], kLimits, checkpoint);
    ASSERT_FALSE(refused.ok()) << k;
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(ReasonOf(refused.status()), kReasonCheckpointMismatch);
  }
  ReconstructionParameters default_told = BlobParameters();
  default_told.clean = true;  // What `virtual-plane` does by default.
  EXPECT_TRUE(Session::Resume(default_told, kLimits, checkpoint).ok());
}

}  // namespace
}  // namespace partiemc::server

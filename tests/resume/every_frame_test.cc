// Resuming at every frame of a recording, from the bytes that a client would hold.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <string>
#include <vector>

#include "resume/workload.h"
#include "server/stream/checkpoint.h"
#include "server/stream/session.h"
#include "server/stream/stream_token.h"

namespace partiemc::resume {
namespace {

using server::Session;

const server::StreamTerms kTerms{.lineage = server::LineageOf(std::string(32, '7')),
                                 .name = "tank"};

constexpr FrameLimits kLimits{.max_particles = 100'000, .max_tiles = 10'000};

// The result of one frame, and the checkpoint after it.
struct Step {
  std::uint64_t rings = 0, mesh = 0, surface = 0;
  std::vector<std::uint64_t> identities;
  std::string checkpoint;

  friend bool operator==(const Step&, const Step&) = default;
};

Step Advance(Session& session, server::Worker& worker, const Workload& workload) {
  const std::uint64_t sequence = session.next_sequence();
  const Frame frame = workload.FrameAt(sequence - 1, 0.01 * static_cast<double>(sequence));
  Step step;
  const auto status =
      session.Answer(sequence, frame, worker, [&](const Result& result, const auto&) {
        step.rings = DigestRings(result.rings);
        step.mesh = DigestMesh(result.mesh);
        step.surface = DigestSurface(result.surface);
        for (const auto& ring : result.rings.measures) step.identities.push_back(ring.identity);
        for (const auto& shell : result.surface.measures) {
          step.identities.push_back(shell.identity);
        }
        return absl::OkStatus();
      });
  EXPECT_EQ(status.ok(), !workload.at(sequence - 1).is_bad) << status;
  step.checkpoint = session.MakeCheckpoint(kTerms, nullptr, ~std::uint64_t{0});
  return step;
}

class EveryFrame : public testing::TestWithParam<Workload (*)()> {
 protected:
  void SetUp() override {
    auto session = Session::Open(workload_.parameters, kLimits);
    ASSERT_TRUE(session.ok()) << session.status();
    for (std::size_t k = 0; k < workload_.frames.size(); ++k) {
      undisturbed_.push_back(Advance(*session, worker_, workload_));
    }
  }

  absl::StatusOr<server::Checkpoint> Parse(std::string_view bytes) const {
    const auto session = Session::Open(workload_.parameters, kLimits);
    return server::ParseCheckpoint(bytes, session->parameters(), kTerms, nullptr);
  }

  Session Resume(std::size_t after) {
    auto checkpoint = Parse(undisturbed_[after - 1].checkpoint);
    EXPECT_TRUE(checkpoint.ok()) << checkpoint.status();
    auto session = Session::Open(workload_.parameters, kLimits);
    EXPECT_TRUE(session->GoOnFrom(*std::move(checkpoint)).ok());
    return *std::move(session);
  }

  const Workload workload_ = GetParam()();
  server::Worker worker_;
  std::vector<Step> undisturbed_;
};

INSTANTIATE_TEST_SUITE_P(Of, EveryFrame, testing::Values(&DamBreak, &Blob, &Leap, &Merge),
                         [](const auto& test) { return "Sequence" + std::to_string(test.index); });

TEST_P(EveryFrame, ANewSessionGoesOnFromItBitForBit) {
  // Resumes after each frame and continues to the end.
  for (std::size_t after = 1; after < undisturbed_.size(); ++after) {
    Session session = Resume(after);
    server::Worker worker;
    ASSERT_EQ(session.next_sequence(), after + 1);
    for (std::size_t k = after; k < undisturbed_.size(); ++k) {
      ASSERT_EQ(Advance(session, worker, workload_), undisturbed_[k])
          << "frame " << k + 1 << ", resumed after frame " << after;
    }
  }
}

TEST_P(EveryFrame, ACheckpointWithAFlippedByteOrALostEndIsRefused) {
  const std::string good = undisturbed_.back().checkpoint;
  for (std::size_t k = 0; k < good.size(); ++k) {
    std::string damaged = good;
    damaged[k] = static_cast<char>(damaged[k] ^ (1 << (k % 8)));
    EXPECT_FALSE(Parse(damaged).ok()) << "byte " << k;
    // An empty checkpoint begins a new stream.
    if (k > 0) {
      EXPECT_FALSE(Parse(good.substr(0, k)).ok()) << k << " bytes";
    }
  }
  EXPECT_FALSE(Parse(good + '\0').ok());
}

}  // namespace
}  // namespace partiemc::resume

// Streams with random orders of legal and illegal messages and events. Each step is compared with a
// small model. A release is tested with PARTIEMC_TRIES=250. A failing order prints its seed;
// PARTIEMC_SEED starts from it.
#include <gtest/gtest.h>

#include <iostream>
#include <limits>
#include <map>
#include <string>

#include "partiemc/status.h"
#include "server/reached_states.h"
#include "server/scripted_transport.h"
#include "server/stream_model.h"
#include "support/random.h"
#include "support/tries.h"

namespace partiemc::server {
namespace {

constexpr FrameLimits kSmallLimits{.max_particles = 40, .max_tiles = 8};
constexpr std::size_t kMostSteps = 60;

ReconstructionParameters Parameters(bool legal) {
  return {
      .placement = Placement::kMarchingSquares, .spacing = 1, .kernel_radius = legal ? 2.0 : 99.0};
}

// Good frame number `index`: a few moving particles.
std::vector<double> GoodFrame(std::size_t index) {
  std::vector<double> positions;
  for (int k = 0; k < 9; ++k) {
    positions.push_back(k % 3 + 0.1 * static_cast<double>(index));
    positions.push_back(k / 3);
  }
  return positions;
}

std::vector<StreamModel::Digests> ResultsOfAnUndisturbedStream() {
  auto session = Session::Open(Parameters(true), kSmallLimits);
  Worker worker;
  std::vector<StreamModel::Digests> results;
  for (std::size_t k = 0; k < kMostSteps; ++k) {
    const MemoryRequest request{RequestKind::kFrame, k + 1, GoodFrame(k)};
    results.push_back(AnswerInMemory(request, *session, worker).digests);
  }
  return results;
}

// One order of events between a client, a network and a server, determined by one seed.
class MessageOrder {
 public:
  MessageOrder(std::uint64_t seed, SteppedPool& pool, MemoryBudget& budget,
               const std::vector<StreamModel::Digests>& results, std::map<std::string, int>& seen,
               ReachedStates& reached)
      : random_(seed),
        window_(1 + random_.Below(4)),
        legal_(!random_.Chance(0.03)),
        slow_reader_(random_.Chance(0.3)),
        pool_(pool),
        seen_(seen),
        reached_(reached),
        model_(window_, legal_, results),
        transport_(pool, budget, window_, Parameters(legal_), kSmallLimits) {}

  void Run() {
    ExpectAsPredicted("start");
    const std::size_t steps = random_.Below(kMostSteps);
    for (std::size_t k = 0; k < steps && !testing::Test::HasFailure(); ++k) Step();
    half_closed_ = true;
    while (!testing::Test::HasFailure() && !transport_.finished()) {
      if (transport_.reading()) {
        EndReads();
      } else if (transport_.writing()) {
        EndWrite(!transport_.cut());
      } else if (model_.computing()) {
        Compute();
      } else {
        FAIL() << "stands still";
      }
    }
    if (transport_.reading()) EndReads();  // Allowed for a transport after the end.
    transport_.machine().Cancelled();
    transport_.machine().Drain();
    transport_.machine().TakenOver();
    ExpectAsPredicted("the end");
    if (const auto end = model_.finished()) {
      ++seen_["ended " + absl::StatusCodeToString(end->code) + " " + end->reason];
    }
  }

 private:
  void Step() {
    const double dice = random_.Unit();
    if (dice < 0.02) {
      SomethingMeanwhile();
      ExpectAsPredicted("an event");
    } else if (dice < 0.4 && transport_.reading()) {
      half_closed_ || random_.Chance(0.05) ? EndReads() : BringRequest();
    } else if (dice < (slow_reader_ ? 0.45 : 0.7) && transport_.writing()) {
      EndWrite(!transport_.cut() && !random_.Chance(0.01));
    } else if (model_.computing()) {
      Compute();
    }
  }

  // Events that may occur at any moment, also during opening and answering.
  void SomethingMeanwhile() {
    SomeEvent();
    reached_.Add(transport_.machine().state());
  }
  void SomeEvent() {
    switch (random_.Below(4)) {
      case 0:
        return Cancel();
      case 1:
        return Drain();
      case 2:
        return TakeOver();
      default:
        return WaitTooLong();
    }
  }

  void BringRequest() {
    auto [request, fault] = RandomRequest();
    ++seen_[request.kind == RequestKind::kFrame && fault.empty() ? "frame" : "other request"];
    if (request.kind == RequestKind::kOpen && random_.Chance(0.1)) {
      transport_.meanwhile = [this] { SomethingMeanwhile(); };
    }
    const bool opens = request.kind == RequestKind::kOpen;
    model_.RequestCame(request, fault);
    const bool opening = opens && model_.opening();
    if (!opening) transport_.meanwhile = nullptr;
    transport_.BringRequest(std::move(request));
    if (opening) model_.OpeningDone();
    ExpectAsPredicted("a request");
  }

  std::pair<MemoryRequest, std::string> RandomRequest() {
    // Usually `open` first and frames after it, so that streams progress.
    const bool first = std::exchange(first_, false);
    if (first != random_.Chance(0.04)) return {{RequestKind::kOpen, 0, {}}, ""};
    if (random_.Chance(0.01)) return {{RequestKind::kMalformed, 0, {}}, ""};
    if (random_.Chance(0.01)) return {{RequestKind::kEmpty, 0, {}}, ""};
    MemoryRequest frame{RequestKind::kFrame, model_.next_sequence(),
                        GoodFrame(model_.good_frames())};
    if (random_.Chance(0.1)) frame.sequence += 1 + random_.Below(3);
    if (random_.Chance(0.1)) frame.sequence -= std::min<std::uint64_t>(frame.sequence, 1);
    switch (random_.Below(12)) {
      case 0:
        frame.positions[random_.Below(18)] = std::numeric_limits<double>::quiet_NaN();
        return {frame, "NOT_FINITE"};
      case 1:
        frame.positions.resize(2 * (kSmallLimits.max_particles + 1));
        return {frame, "TOO_MANY_PARTICLES"};
      case 2:
        for (std::size_t k = 0; k < 18; ++k) frame.positions[k] *= 1000;
        return {frame, "TOO_MANY_TILES"};
      case 3:
        frame.positions[random_.Below(18)] = 1e300;
        return {frame, "OUT_OF_RANGE"};
      default:
        return {frame, ""};
    }
  }

  void EndReads() {
    half_closed_ = true;
    model_.ReadsEnded();
    transport_.EndReads();
    ExpectAsPredicted("no more requests");
  }

  void EndWrite(bool ok) {
    model_.WriteDone(ok);
    transport_.EndWrite(ok);
    ExpectAsPredicted(ok ? "a write" : "a failed write");
  }

  void Compute() {
    const bool answers = model_.TakeUp();
    if (answers && random_.Chance(0.03)) transport_.meanwhile = [this] { SomethingMeanwhile(); };
    pool_.Step();
    model_.Computed(answers);
    ExpectAsPredicted("a frame computed");
  }

  void Cancel() {
    half_closed_ = true;
    model_.Cancelled();
    transport_.machine().Cancelled();
    ++seen_["cancel"];
  }
  void Drain() {
    model_.Drained();
    transport_.machine().Drain();
    ++seen_["drain"];
  }
  void TakeOver() {
    model_.TakenOver();
    transport_.machine().TakenOver();
    ++seen_["taken over"];
  }
  void WaitTooLong() {
    constexpr IdleLimits kLimit{std::chrono::milliseconds(1), std::chrono::milliseconds(1)};
    model_.WaitedTooLong();
    transport_.machine().EndIfIdle(kLimit,
                                   std::chrono::steady_clock::now() + std::chrono::hours(1));
    ++seen_["idle"];
  }

  void ExpectAsPredicted(const char* after) {
    SCOPED_TRACE(testing::Message() << "after " << after);
    reached_.Add(transport_.machine().state());
    EXPECT_EQ(transport_.reading(), model_.reading());
    EXPECT_EQ(transport_.writing() == model_.writing(), true)
        << "sequence " << (transport_.writing() ? transport_.writing()->sequence : 0) << " and "
        << (model_.writing() ? model_.writing()->sequence : 0);
    EXPECT_EQ(transport_.cut(), model_.cut());
    EXPECT_EQ(End(), model_.finished());
    const StreamCounts counts = transport_.machine().counts();
    EXPECT_EQ(counts.frames, model_.results());
    EXPECT_EQ(counts.frame_errors, model_.errors());
    EXPECT_EQ(counts.last_sequence, model_.last_sequence());
  }

  std::optional<StreamEnd> End() const {
    if (!transport_.finished()) return std::nullopt;
    const auto violation = FindViolation(*transport_.finished());
    return StreamEnd{transport_.finished()->code(), violation ? violation->reason : ""};
  }

  support::Random random_;
  const std::size_t window_;
  const bool legal_, slow_reader_;
  SteppedPool& pool_;
  std::map<std::string, int>& seen_;
  ReachedStates& reached_;
  StreamModel model_;
  ScriptedTransport transport_;
  bool first_ = true, half_closed_ = false;
};

TEST(MessageOrders, AreAnsweredAsTheModelSays) {
  const std::uint64_t orders = support::Tries(4000u);
  const std::uint64_t first = support::FirstSeed();
  const auto results = ResultsOfAnUndisturbedStream();
  SteppedPool pool;
  MemoryBudget budget(std::uint64_t{1} << 40);
  std::map<std::string, int> seen;
  ReachedStates reached;
  for (std::uint64_t seed = first; seed < first + orders; ++seed) {
    SCOPED_TRACE(testing::Message() << "PARTIEMC_SEED=" << seed << " PARTIEMC_TRIES=0");
    MessageOrder(seed, pool, budget, results, seen, reached).Run();
    EXPECT_EQ(budget.held(), 0u);
    if (HasFailure()) return;  // The first failure is enough.
  }
  for (const auto& [what, count] : seen) std::cout << what << ": " << count << '\n';
  if (orders < support::Tries(1000u)) return;
  std::cout << "states reached: " << reached.count() << '\n';
  reached.ExpectAllRowsOf(MachineKind::kStream);
  // All kinds of events must have occurred.
  for (const char* end :
       {"OK ", "CANCELLED ", "INVALID_ARGUMENT PROTOCOL", "UNAVAILABLE DRAINING",
        "DEADLINE_EXCEEDED IDLE", "ABORTED TAKEN_OVER", "INVALID_ARGUMENT OUT_OF_RANGE"}) {
    EXPECT_GT(seen[std::string("ended ") + end], 0) << end;
  }
}

}  // namespace
}  // namespace partiemc::server

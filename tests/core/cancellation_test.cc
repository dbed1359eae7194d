// A frame that is cancelled during the computation changes nothing. Also under ThreadSanitizer.
#include "base/cancellation.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <atomic>
#include <cstdint>
#include <new>
#include <span>
#include <thread>
#include <vector>

#include "base/parallel.h"
#include "cut/ring_cut.h"
#include "partiemc/partiemc.h"
#include "partiemc/surface_reconstructor.h"
#include "support/particles.h"
#include "support/random.h"

namespace partiemc {
namespace {

using support::Particles;

constexpr int kFrameCount = 4;

// A body that moves, with holes, beside drops, with ids: every stage has something to do.
Particles SceneAt(int frame) {
  Particles particles = support::Disc(60, 0.4 * frame, 0);
  support::Random random(3);
  for (int k = 0; k < 30; ++k) {
    particles.Add(support::Disc(1 + k % 4, 75 + 9 * (k % 6) + 0.4 * frame, 9 * (k / 6) - 20));
  }
  Particles thinned;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    if (!random.Chance(0.06)) {
      thinned.Add(particles.x(k), particles.y(k));
      thinned.ids.push_back(k);
    }
  }
  thinned.time = frame;
  return thinned;
}

// Counts the stages of a frame and cancels it at the end of one.
class CancelAfter final : public StageObserver {
 public:
  CancelAfter(Stage stage, std::atomic<bool>& flag) : stage_(stage), flag_(flag) {}
  void StageBegins(Stage stage) override { last_ = stage; }
  void StageEnds(Stage stage) override {
    if (stage == stage_) flag_ = true;
  }
  Stage last() const { return last_; }

 private:
  const Stage stage_;
  std::atomic<bool>& flag_;
  Stage last_ = Stage::kBins;
};

class Cancellation : public testing::TestWithParam<unsigned> {
 protected:
  Cancellation() {
    for (int k = 0; k < kFrameCount; ++k) frames_.push_back(SceneAt(k));
    for (const Particles& frame : frames_) {
      values_.emplace_back(frame.xy.begin(), frame.xy.end());
      attributes_.push_back({.name = "place", .components = 2, .values = values_.back()});
    }
    State state;
    Workspace workspace;
    Result result;
    for (int k = 0; k < kFrameCount; ++k) {
      EXPECT_TRUE(reconstructor_->Reconstruct(FrameAt(k), state, workspace, result).ok());
      expected_.push_back(result);
      states_.push_back(state);
    }
  }

  Frame FrameAt(int k) const {
    Frame frame = frames_[k].AsFrame();
    frame.attributes = std::span(attributes_).subspan(k, 1);
    return frame;
  }

  // The frame after the first `done`, undisturbed.
  void ExpectNext(int done, State& state, Workspace& workspace) {
    Result result;
    ASSERT_TRUE(reconstructor_->Reconstruct(FrameAt(done), state, workspace, result).ok());
    EXPECT_EQ(result, expected_[done]);
    EXPECT_EQ(state, states_[done]);
  }

  const tbb::global_control control_{tbb::global_control::max_allowed_parallelism, GetParam()};
  Arena arena_{GetParam()};
  const absl::StatusOr<Reconstructor> reconstructor_ =
      Reconstructor::Create({.fill = Fill::kConforming, .spacing = 1});
  std::vector<Particles> frames_;
  std::vector<std::vector<float>> values_;
  std::vector<Attribute> attributes_;  // Each of its frame.
  std::vector<Result> expected_;
  std::vector<State> states_;
};

TEST_P(Cancellation, AfterAnyStageLeavesNoTrace) {
  arena_.Execute([&] {
    State state;
    Workspace workspace;
    ExpectNext(0, state, workspace);
    for (std::size_t stage = 0; stage + 1 < kStageCount; ++stage) {
      SCOPED_TRACE(testing::Message() << kStageNames[stage]);
      std::atomic<bool> flag = false;
      CancelAfter observer(static_cast<Stage>(stage), flag);
      Result result = expected_[0];
      const absl::Status status = reconstructor_->Reconstruct(
          FrameAt(3), state, workspace, result, {.observer = &observer, .cancelled = &flag});
      EXPECT_TRUE(absl::IsCancelled(status)) << status;
      EXPECT_EQ(observer.last(), static_cast<Stage>(stage)) << "it went on";
      EXPECT_EQ(result, Result());
      EXPECT_EQ(state, states_[0]);
      State next = state;
      ExpectNext(1, next, workspace);
    }
  });
}

/// From another thread, at whatever moment that has: most frames end within a stage.
TEST_P(Cancellation, AtAnyMomentLeavesNoTrace) {
  State state;
  Workspace workspace;
  support::Random random(GetParam());
  int cancelled = 0, whole = 0;
  for (int round = 0; round < 60; ++round) {
    SCOPED_TRACE(testing::Message() << "round " << round);
    const int done = round % (kFrameCount - 1);
    state = done == 0 ? State() : states_[done - 1];
    std::atomic<bool> flag = false;
    std::atomic<bool> has_begun = false;
    const std::uint64_t wait = random.Below(40'000);
    std::thread canceller([&] {
      while (!has_begun.load(std::memory_order_relaxed)) std::this_thread::yield();
      for (std::uint64_t k = 0; k < wait; ++k) has_begun.load(std::memory_order_relaxed);
      flag.store(true, std::memory_order_relaxed);
    });
    Result result;
    absl::Status status;
    arena_.Execute([&] {
      has_begun.store(true, std::memory_order_relaxed);
      status = reconstructor_->Reconstruct(FrameAt(done), state, workspace, result,
                                           {.cancelled = &flag});
    });
    canceller.join();
    if (status.ok()) {
      ++whole;
      EXPECT_EQ(result, expected_[done]);
    } else {
      ++cancelled;
      EXPECT_TRUE(absl::IsCancelled(status)) << status;
      EXPECT_EQ(result, Result());
      EXPECT_EQ(state, done == 0 ? State() : states_[done - 1]);
      arena_.Execute([&] { ExpectNext(done, state, workspace); });
    }
    arena_.Execute([&] { ExpectNext(done + 1, state, workspace); });
  }
  EXPECT_GT(cancelled, 0) << whole << " were not";
}

/// Tasks inside a task are cancelled too: oneTBB skips some of them.
TEST_P(Cancellation, ATaskThatIsGivenUpDoesNotGoOnWithHalfOfItsParts) {
  std::atomic<bool> went_on_with_half = false;
  const auto run = [&](const std::atomic<bool>* flag, const auto& at_piece) {
    const CancellationScope scope(flag);
    ParallelFor(64, [&](int outer) {
      std::atomic<int> done = 0;
      ParallelFor(256, [&](int inner) {
        at_piece(outer, inner);
        ++done;
      });
      if (done != 256) went_on_with_half = true;
    });
  };
  for (int round = 0; round < 50; ++round) {
    arena_.Execute([&] {
      std::atomic<bool> flag = false;
      EXPECT_THROW(run(&flag,
                       [&](int outer, int inner) {
                         if (outer == round % 64 && inner == 200) flag = true;
                       }),
                   Cancelled);
      EXPECT_THROW(run(nullptr,
                       [&](int outer, int inner) {
                         if (outer == round % 64 && inner == 200) throw std::bad_alloc();
                       }),
                   std::bad_alloc);
    });
  }
  EXPECT_FALSE(went_on_with_half);
}

// The rings alone, without parallel.h.
TEST(CancelledCut, OfRingsKeepsRings) {
  const std::atomic<bool> flag = true;
  const CancellationScope scope(&flag);
  const Percolation percolation{};
  const RingTopology topology;
  const RingCutInput input{.percolation = percolation, .topology = topology, .spacing = 1};
  RingCutScratch scratch;
  PlacedVertices placed;
  Rings rings;
  std::uint64_t bodies = 7;
  EXPECT_THROW((void)CutRings(input, 0, scratch, placed, rings, bodies), Cancelled);
  EXPECT_EQ(bodies, 7u);
}

// Grants all memory, and cancels the frame when it is asked for the last of `requests`.
class CancelAtRequest final : public MemoryGuard {
 public:
  CancelAtRequest(int requests, std::atomic<bool>& flag) : left_(requests), flag_(flag) {}
  bool Reserve(std::uint64_t) override {
    if (--left_ == 0) flag_ = true;
    return true;
  }
  int left() const { return left_; }

 private:
  int left_;
  std::atomic<bool>& flag_;
};

class SurfaceCancellation : public testing::TestWithParam<unsigned> {
 protected:
  SurfaceCancellation() {
    support::Random random(5);
    for (int p = 0; p < 16 * 16 * 16; ++p) {
      for (const int at : {p % 16, p / 16 % 16, p / 256}) xyz_.push_back(at + random.Unit());
    }
    SurfaceWorkspace workspace;
    EXPECT_TRUE(Reconstruct(workspace, expected_, {}).ok());
    EXPECT_GT(expected_.TriangleCount(), 1000u);
  }

  absl::Status Reconstruct(SurfaceWorkspace& workspace, Surface& surface,
                           const FrameControl& control) {
    const Frame frame{.positions = std::span<const double>(xyz_), .components = 3};
    absl::Status status;
    arena_.Execute(
        [&] { status = reconstructor_->Reconstruct(frame, workspace, surface, control); });
    return status;
  }

  // The next surface after a cancelled one is right.
  void ExpectNext(SurfaceWorkspace& workspace) {
    Surface surface;
    ASSERT_TRUE(Reconstruct(workspace, surface, {}).ok());
    EXPECT_EQ(surface, expected_);
  }

  const tbb::global_control control_{tbb::global_control::max_allowed_parallelism, GetParam()};
  Arena arena_{GetParam()};
  const absl::StatusOr<SurfaceReconstructor> reconstructor_ =
      SurfaceReconstructor::Create({.placement = SurfacePlacement::kVirtualPlane, .simplify = .05});
  std::vector<double> xyz_;
  Surface expected_;
};

TEST_P(SurfaceCancellation, BetweenStagesLeavesNoTrace) {
  SurfaceWorkspace workspace;
  for (const int requests : {0, 1, 2}) {
    SCOPED_TRACE(testing::Message() << requests << " requests");
    std::atomic<bool> flag = requests == 0;
    CancelAtRequest guard(requests, flag);
    Surface surface = expected_;
    const absl::Status status =
        Reconstruct(workspace, surface, {.memory = &guard, .cancelled = &flag});
    EXPECT_TRUE(absl::IsCancelled(status)) << status;
    EXPECT_EQ(guard.left(), 0) << "it went on";
    EXPECT_EQ(surface, Surface());
    ExpectNext(workspace);
  }
}

/// From another thread, at whatever moment that has.
TEST_P(SurfaceCancellation, AtAnyMomentLeavesNoTrace) {
  SurfaceWorkspace workspace;
  support::Random random(GetParam());
  int cancelled = 0;
  for (int round = 0; round < 20; ++round) {
    SCOPED_TRACE(testing::Message() << "round " << round);
    std::atomic<bool> flag = false, has_begun = false;
    const std::uint64_t wait = random.Below(4'000'000);
    std::thread canceller([&] {
      while (!has_begun.load(std::memory_order_relaxed)) std::this_thread::yield();
      for (std::uint64_t k = 0; k < wait; ++k) has_begun.load(std::memory_order_relaxed);
      flag.store(true, std::memory_order_relaxed);
    });
    Surface surface;
    has_begun.store(true, std::memory_order_relaxed);
    const absl::Status status = Reconstruct(workspace, surface, {.cancelled = &flag});
    canceller.join();
    if (status.ok()) {
      EXPECT_EQ(surface, expected_);
    } else {
      ++cancelled;
      EXPECT_TRUE(absl::IsCancelled(status)) << status;
      EXPECT_EQ(surface, Surface());
      ExpectNext(workspace);
    }
  }
  EXPECT_GT(cancelled, 0);
}

INSTANTIATE_TEST_SUITE_P(Threads, Cancellation, testing::Values(1u, 2u, 5u),
                         [](const auto& tested) { return std::to_string(tested.param); });

INSTANTIATE_TEST_SUITE_P(Threads, SurfaceCancellation, testing::Values(1u, 2u, 5u),
                         [](const auto& tested) { return std::to_string(tested.param); });

}  // namespace
}  // namespace partiemc
